"""What the user settles when registering is kept, and used by every command that loads the file."""

from pathlib import Path

import numpy as np
import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.recordings import RecordingSettings, SpeedSource, load_recording
from srbval.recordings.registry import FileStatus, add, load_entry, load_registered, verify

from . import files


def two_columns(path: Path) -> Path:
    np.save(path, np.stack([files.vibration(seed=i) for i in range(2)], axis=1))
    return path


def test_settled_once_and_kept(tmp_path: Path) -> None:
    path = two_columns(tmp_path / "two.npy")
    (open_,) = add(tmp_path).recordings
    assert "--channel data[1] | data[2]; no sampling rate: --fs HZ; no unit: --unit m/s2 |" in (open_.reason or "")
    assert "no bearing: --bearing NAME | FILE.toml; no shaft speed: --rpm R, or --tacho CHANNEL" in (open_.reason or "")
    given = RecordingSettings(channel="data[2]", fs_hz=8000.0, unit="g", bearing="skf-6205", rpm=1500.0)
    (entry,) = add(path, settings=given).recordings
    assert (entry.status, entry.reason, entry.channel, entry.fs_hz) == (FileStatus.OK, None, "data[2]", 8000.0)
    for again in (add(tmp_path), verify()):
        assert again.recordings[0].settings == given
    for recording in (load_registered(path), load_entry(verify().recordings[0])):
        assert (recording.channel, recording.fs_hz, recording.unit) == ("data[2]", 8000.0, "m/s2")
    with pytest.raises(DataError, match="leaves open"):
        load_recording(path)  # the plain loader knows nothing of the register
    add(path, settings=RecordingSettings(fs_hz=9000.0))  # later options go over kept ones
    assert (load_registered(path).fs_hz, load_registered(path).channel) == (9000.0, "data[2]")
    assert load_registered(path, RecordingSettings(channel="data[1]")).channel == "data[1]"
    assert add(path, repin=True).recordings[0].settings is None


def test_option_that_one_file_of_a_folder_has_no_use_for(tmp_path: Path) -> None:
    two_columns(tmp_path / "two.npy")
    np.save(tmp_path / "one.npy", files.vibration())
    given = {"fs_hz": 8000.0, "unit": "g", "bearing": "skf-6205", "rpm": 1500.0}
    found = add(tmp_path, settings=RecordingSettings(channel="data[2]", **given)).recordings
    one, two = sorted(found, key=lambda r: r.file)
    assert (two.channel, two.reason) == ("data[2]", None)
    assert (one.status, one.channel, one.fs_hz) == (FileStatus.OK, "data", 8000.0)
    assert "no channel 'data[2]'; it has data" in (one.reason or "")


def test_a_set_point_is_not_a_measured_speed(tmp_path: Path) -> None:
    path = tmp_path / "one.npy"
    np.save(path, files.vibration(seed=0))
    given = {"fs_hz": 8000.0, "unit": "g", "rpm": 1500.0}
    measured, nominal = load_recording(path, **given), load_recording(path, **given, rpm_tolerance_pct=2.0)
    assert (measured.speed.source, measured.speed.ci95_hz) == (SpeedSource.STATED, 1 / 60)
    assert (nominal.speed.source, nominal.speed.ci95_hz) == (SpeedSource.NOMINAL, 0.5)
    assert "set point kept within 2 %" in " ".join(nominal.notes)
    add(path, settings=RecordingSettings(fs_hz=8000.0, unit="g", rpm=1500.0, rpm_tolerance_pct=2.0))
    assert load_registered(path).speed == nominal.speed
    again = load_registered(path, RecordingSettings(rpm=1490.0))
    assert again.speed.source is SpeedSource.STATED  # the kept tolerance was that of the kept speed


@pytest.mark.parametrize("wrong", [{"rpm_tolerance_pct": 1.0}, {"rpm": 1500.0, "rpm_tolerance_pct": 11.0}])
def test_a_tolerance_needs_its_speed_and_has_a_limit(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=r"--rpm.*at most 10 %"):
        RecordingSettings(**wrong)
