"""One record in every format, files of no known data set, the structures of MATLAB, and runs that srbval wrote."""

import re
import shlex
import sys

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import eye_array

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.reading.analyse import analyse
from srbval.recordings import Origin, Recording, RecordingSettings, SpeedSource, load_recording
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.speed import stated_speed

from . import files
from .formats import BEARING, FS_HZ, SHAFT_HZ, WRITERS, G, record, whole

DIGITS = 2e-6  # relative, of the largest sample: seven digits, or 24 bits
LINE_DIGITS = 1e-5  # relative, of a line: six digits of a time step, and those of the samples
TIME_DIGITS = 1e-6  # times written with six decimals
SAMPLE_DIGITS = 1e-8  # samples written with ten digits


@pytest.fixture(scope="module")
def direct():
    """The same samples without any file."""
    facts = {"origin": Origin.MEASURED, "unit": "m/s2", "fs_hz": FS_HZ, "speed": stated_speed(SHAFT_HZ * 60, 1.0)}
    made = Recording(name="x", channels={"a": record()[1] * G}, channel="a", **facts)
    return analyse(made, bearing=BEARING, band_hz=(1400.0, 2800.0))


@pytest.mark.parametrize("kind", WRITERS)
def test_the_same_lines_from_every_format(kind, tmp_path, direct):
    path = tmp_path / "record.dat"  # its name says nothing
    path.write_bytes(whole(kind))
    settings = RecordingSettings(**{"channel": "acc DE", "rpm": SHAFT_HZ * 60, **WRITERS[kind][1]})
    recording = load_recording(path, settings)
    assert recording.unit == "m/s2"
    assert recording.fs_hz == pytest.approx(FS_HZ, rel=LINE_DIGITS)
    samples = recording.channels[recording.channel or ""]
    np.testing.assert_allclose(samples, record()[1] * G, atol=DIGITS * G * np.abs(record()[1]).max())
    found = analyse(recording, bearing=BEARING, band_hz=(1400.0, 2800.0))
    assert [line.detected for line in found.lines] == [line.detected for line in direct.lines]
    assert found.line("BPFO").detected
    for line, same in zip(found.lines, direct.lines, strict=True):
        if line.detected:
            assert line.found_hz == pytest.approx(same.found_hz, rel=LINE_DIGITS)


@pytest.mark.parametrize("kind", ["wav", "parquet"])
def test_a_library_that_is_missing_is_named(kind, tmp_path, monkeypatch):
    path = tmp_path / "x.dat"
    path.write_bytes(whole(kind))
    limited.end_readers()
    (tmp_path / "broken").mkdir()
    module, name = detect_format(path).library or ("", "")
    (tmp_path / "broken" / f"{module.split('.')[0]}.py").write_text("raise ImportError('none here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "broken"))
    command = f"{shlex.quote(sys.executable)} -m pip install {name}"
    with pytest.raises(DataError, match=rf"library {name}, .* Install it: {re.escape(command)}$"):
        load_recording(path)
    limited.end_readers()


def test_csv_with_time_column_and_settings(tmp_path):
    table = np.stack([np.arange(1000) / 5000, files.vibration(1000)], axis=1)
    path = tmp_path / "record.csv"
    path.write_text("# unit = g\n# rpm = 1200\ntime_s,acc\n" + "\n".join(f"{t:.6f},{x:.9e}" for t, x in table))
    r = load_recording(path)
    assert (r.fs_hz, r.channel, r.unit) == (pytest.approx(5000, rel=TIME_DIGITS), "acc", "m/s2")
    np.testing.assert_allclose(r.channels["acc"], files.vibration(1000) * G, rtol=SAMPLE_DIGITS)
    assert (r.speed.source, r.speed.value_hz) == (SpeedSource.STATED, pytest.approx(20.0))


def test_matrix_columns_are_channels(tmp_path):
    np.save(tmp_path / "m.npy", np.stack([files.vibration(seed=i) for i in range(3)]))
    r = load_recording(tmp_path / "m.npy", channel="data[3]", fs_hz=1000, unit="g")
    np.testing.assert_allclose(r.channels["data[3]"], files.vibration(seed=2) * G)


def test_a_unit_that_is_not_known(tmp_path):
    savemat(tmp_path / "a.mat", {"x": np.array(files.vibration()), "fs": 8000.0, "unit": "furlong/s2"})
    assert "left out: unit 'furlong/s2', which is not known" in load_recording(tmp_path / "a.mat", unit="g").notes


def test_structs_cells_and_texts_of_matlab(tmp_path):
    pair = np.empty((1, 2), dtype=object)
    pair[0, :] = [np.arange(3.0), "second"]
    written = {
        "s": {"x": np.eye(2), "inner": {"label": "grün", "n": 7}},
        "box": files.nested(files.nested(np.arange(4.0))),
        "pair": pair,
        "table": np.array([(1.0, 2.0), (3.0, 4.0)], dtype=[("a", "f8"), ("b", "f8")]),
        "empty": np.zeros((0, 3)),
        "sparse": eye_array(5).tocsc(),
        "complex": np.ones(3) * 1j,
    }
    savemat(tmp_path / "a.mat", written, oned_as="column")
    raw = detect_format(tmp_path / "a.mat").load(tmp_path / "a.mat")
    np.testing.assert_array_equal(raw.variables["s.x"], np.eye(2))
    assert (raw.text("s.inner.label"), raw.number("s.inner.n")) == ("grün", 7)
    np.testing.assert_array_equal(np.ravel(raw.variables["box"]), np.arange(4.0))
    np.testing.assert_array_equal(np.ravel(raw.variables["pair(1)"]), np.arange(3.0))
    assert raw.text("pair(2)") == "second"
    assert [raw.number(f"table({i}).{field}") for i in (1, 2) for field in "ab"] == [1, 2, 3, 4]
    assert np.size(raw.variables["empty"]) == 0
    assert not {"sparse", "complex"} & set(raw.variables)


def run_file(path, **attributes):
    defaults = {"schema_version": 1, "srbval_kind": "run", "name": "a run", "fs_hz": 61440.0, "unit": "m/s2"}
    more = {"bearing": "skf-22240", "state": "outer", "shaft_speed_hz": 11.8333, "radial_n": 124800.0}
    with h5py.File(path, "w") as file:
        file.attrs.update(defaults | more | attributes)
        for i, axis in enumerate("xyz"):
            file[f"acceleration_{axis}_m_s2"] = files.vibration(seed=i)
        file["cage_speed_rad_s"] = files.vibration(seed=9)
    return path


def test_run_becomes_a_simulated_recording_with_two_axes(tmp_path):
    r = load_recording(run_file(tmp_path / "run.h5", cage_ratio=0.43))
    assert (r.origin, r.axes, r.channel, r.unit) == (Origin.SIMULATED, ("x", "y"), None, "m/s2")
    assert (r.fs_hz, r.state, r.bearing, r.radial_n) == (61440.0, Fault.OUTER, "skf-22240", 124800.0)
    assert (r.speed.value_hz, r.speed.source, r.cage_ratio) == (11.8333, SpeedSource.PRESCRIBED, pytest.approx(0.43))
    np.testing.assert_array_equal(r.channels["z"], files.vibration(seed=2))
    assert load_recording(tmp_path / "run.h5", channel="y").axes is None


SCENES = ("[" * 50_000, '{"speed_profile": 1' + "0" * 5000 + "}", "[]", '{"speed_profile": [[]]}')


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"srbval_kind": "other"}, "srbval_kind is 'other'"),
        ({"state": "rusty"}, "state 'rusty'"),
        ({"status": "cage-lost", "reason": "the cage stopped"}, r"run failed \(cage-lost: the cage stopped\)"),
        *(({"scene": scene}, "scene stored with the run") for scene in SCENES),
    ],
)
def test_run_that_cannot_be_read(tmp_path, attributes, message):
    with pytest.raises(DataError, match=message):
        load_recording(run_file(tmp_path / "run.h5", **attributes))
