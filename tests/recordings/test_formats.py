"""One synthetic record in each format: the same channel, unit, rate and lines everywhere."""

import re
import shlex
import sys

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.reading.analyse import analyse
from srbval.recordings import Origin, Recording, RecordingSettings, load_recording
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.speed import stated_speed

from .formats import BEARING, FS_HZ, SHAFT_HZ, WRITERS, G, record, whole

DIGITS = 2e-6  # relative, of the largest sample: seven digits, or 24 bits
LINE_DIGITS = 1e-5  # relative, of a line: six digits of a time step, and those of the samples


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
