"""The rig's excerpts that ship with the program: what they hold, whence they come, that they are the originals."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.reading.analyse import analyse
from srbval.recordings import Origin, SpeedSource, load_recording
from srbval.recordings.datasets.description import dataset
from srbval.recordings.registry import add, healthy_baseline, lookup, rig_recordings
from srbval.recordings.registry.manifest import manifest_path
from srbval.recordings.registry.register import shipped_recordings
from srbval.report.findings.provenance import provenance
from srbval.storage.installation import shipped_folder

from . import files

FOLDER = shipped_folder("data_manifest/rig_excerpts")
POINTS = {(state, rpm) for state in Fault for rpm in (353.0, 877.0)}
MOST_BYTES = 2_000_000
SINGLE = 2.0**-24  # relative error of rounding to single precision
MEAN_SPEED = 1e-6  # relative: of the mean of every 32nd value
PUBLISHED_RPM = 6e-4  # the author's means are rounded to 0.001 rpm
SPEED_CI = 0.001  # a tachometer's mean over 2 s is known to better than a per mille
LINES = 2e-6  # relative: of a line's frequency, with the mean speed


def test_what_ships_is_small_and_says_where_it_comes_from():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < MOST_BYTES
    licence = (FOLDER / "LICENSE.txt").read_text()
    assert "Copyright (c) 2025 Politecnico di Torino" in licence
    assert "The above copyright notice and this permission notice shall be included in all" in licence
    described = (FOLDER / "README.md").read_text()
    published = {file.name: file for file in dataset("torino-excerpts").files}
    packed = sorted(FOLDER.glob("*.h5"))
    assert len(packed) == len(POINTS)
    for path in packed:
        original = published[f"{path.stem}.mat"]
        assert original.used_for  # so that every point of the grid counts as opened
        with h5py.File(path) as file:
            assert f"{original.name}, SHA-256 {original.sha256}" in file.attrs["copy_of"]
            assert file.attrs["source"] == original.url
            assert file["acc_m_s2"].dtype == np.float32
        assert f"| `{path.name}` | `{original.name}` | `{original.sha256}` |" in described
        assert (original.url or "").split("/")[5] in described  # the commit


def test_they_serve_where_nothing_is_registered(tmp_path, monkeypatch):
    monkeypatch.setattr(lookup, "shipped_recordings", shipped_recordings)  # hidden from other tests
    found = rig_recordings()
    assert {(r.state, r.nominal_rpm) for r in found} == POINTS
    for entry in found:
        assert (entry.dataset, entry.origin, entry.radial_kn) == ("torino-excerpts", Origin.MEASURED, 124.8)
        recording = load_recording(entry.file)
        assert (recording.fs_hz, recording.unit, recording.seconds) == (20480.0, "m/s2", 2.0)
        assert recording.speed.source is SpeedSource.TACHOMETER
        assert any("compact copy of" in note and "SHA-256" in note for note in recording.notes)
    facts = provenance((), found)["recordings_shipped_with_srbval"]
    assert "OR_877rpm_sample.h5" in facts["files"]
    assert "commit 946782ab" in facts["source"]
    assert "Copyright (c) 2025 Politecnico di Torino" in facts["licence"]
    assert "recordings_shipped_with_srbval" not in provenance((), ())
    (outer,) = rig_recordings(state=Fault.OUTER, nominal_rpm=877)
    assert Path(healthy_baseline(load_recording(outer.file)).file).name == "H_877rpm_sample.h5"
    files.excerpt(tmp_path / "mine.mat", condition="OR", rpm_nominal=877)
    add(tmp_path)
    (own,) = rig_recordings(state=Fault.OUTER, nominal_rpm=877)
    assert Path(own.file).name == "mine.mat"  # registered ones come first
    assert {(r.state, r.nominal_rpm) for r in rig_recordings()} == POINTS
    manifest_path().write_text("{")
    assert shipped_recordings() == found


@pytest.mark.recordings
def test_they_are_the_originals(recordings_dir):
    bearing, published = load_bearing("skf-22240"), dataset("torino-excerpts").published_speeds
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published.means}
    for path in sorted(FOLDER.glob("*.h5")):
        compact, original = load_recording(path), load_recording(recordings_dir / "torino" / f"{path.stem}.mat")
        for fact in ("state", "bearing", "fs_hz", "unit", "radial_n", "axial_n", "nominal_rpm", "channel", "band_hz"):
            assert getattr(compact, fact) == getattr(original, fact), fact
        a, b = compact.channels["sensor_4"], original.channels["sensor_4"]
        np.testing.assert_allclose(a, b, rtol=SINGLE, atol=0)
        speed, every = compact.speed_signal, round(original.speed_signal.rate_hz / compact.speed_signal.rate_hz)
        assert speed.rate_hz == 640.0
        np.testing.assert_allclose(speed.values_hz, original.speed_signal.values_hz[::every], rtol=2 * SINGLE)
        mean_rpm = means[original.state, original.nominal_rpm]
        assert original.speed.value_hz * 60 == pytest.approx(mean_rpm, abs=PUBLISHED_RPM)
        assert 0 < original.speed.ci95_hz * 60 < SPEED_CI * mean_rpm
        assert compact.speed.value_hz == pytest.approx(original.speed.value_hz, rel=MEAN_SPEED)
        assert compact.speed.ci95_hz == pytest.approx(original.speed.ci95_hz, rel=0.05)
        if path.stem.startswith(("OR_", "IR_")):
            lines = [analyse(r, bearing=bearing).line_of(r.state or Fault.HEALTHY) for r in (compact, original)]
            assert lines[0].found_hz == pytest.approx(lines[1].found_hz, rel=LINES)
