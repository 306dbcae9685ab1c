"""Statements of the user, by options or a table of labels: stored at registration, used by every command."""

from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError
from srbval.recordings import RecordingSettings, SpeedSource, load_recording
from srbval.recordings.registry import FileStatus, add, healthy_baseline, load_entry, load_registered, verify

from . import files

GIVEN = {"fs_hz": 8000.0, "unit": "g", "bearing": "skf-6205", "rpm": 1500.0}
HEADER = "file;state;bearing;rpm;radial_kn;channel;fs;unit"


@pytest.fixture
def folder(tmp_path):
    """A folder of files of two channels, and one file of one channel."""
    (tmp_path / "rig").mkdir()
    for i, name in enumerate(("a.npy", "b.npy")):
        np.save(tmp_path / "rig" / name, np.stack([files.vibration(seed=2 * i + k) for k in range(2)], axis=1))
    np.save(tmp_path / "rig" / "one.npy", files.vibration())
    return tmp_path / "rig"


def labelled(folder, *rows, header=HEADER):
    path = folder.parent / "labels.csv"
    path.write_text("\n".join(["\ufeff" + header, *rows]) + "\n", encoding="utf-8")
    return path


def test_stated_once_and_stored(folder):
    path = folder / "a.npy"
    (asked,) = add(path).recordings
    assert "--channel data[1] | data[2]; no sampling rate: --fs HZ; no unit: --unit m/s2 |" in (asked.reason or "")
    assert "no bearing: --bearing NAME | FILE.toml; no shaft speed: --rpm R, or --tacho CHANNEL" in (asked.reason or "")
    given = RecordingSettings(channel="data[2]", **GIVEN)
    (entry,) = add(path, settings=given).recordings
    assert (entry.status, entry.reason, entry.channel, entry.fs_hz) == (FileStatus.OK, None, "data[2]", 8000.0)
    for again in (add(path), verify()):
        assert again.recordings[0].settings == given
    for recording in (load_registered(path), load_entry(verify().recordings[0])):
        assert (recording.channel, recording.fs_hz, recording.unit) == ("data[2]", 8000.0, "m/s2")
    with pytest.raises(DataError, match="leaves open"):
        load_recording(path)  # the plain loader does not use the register
    add(path, settings=RecordingSettings(fs_hz=9000.0))  # later options go over stored ones
    assert (load_registered(path).fs_hz, load_registered(path).channel) == (9000.0, "data[2]")
    assert load_registered(path, RecordingSettings(channel="data[1]")).channel == "data[1]"
    assert add(path, repin=True).recordings[0].settings is None


def test_an_option_that_one_file_of_a_folder_has_no_use_for(folder):
    found = add(folder, settings=RecordingSettings(channel="data[2]", **GIVEN)).recordings
    *two, one = found
    assert [(entry.channel, entry.reason) for entry in two] == [("data[2]", None)] * 2
    assert (one.status, one.channel, one.fs_hz) == (FileStatus.OK, "data", 8000.0)
    assert "no channel 'data[2]'; it has data" in (one.reason or "")


def test_a_set_point_is_not_a_measured_speed(folder):
    path, given = folder / "one.npy", {"fs_hz": 8000.0, "unit": "g", "rpm": 1500.0}
    measured, nominal = load_recording(path, **given), load_recording(path, **given, rpm_tolerance_pct=2.0)
    assert (measured.speed.source, measured.speed.ci95_hz) == (SpeedSource.STATED, 1 / 60)
    assert (nominal.speed.source, nominal.speed.ci95_hz) == (SpeedSource.NOMINAL, 0.5)
    assert "set point kept within 2 %" in " ".join(nominal.notes)
    add(path, settings=RecordingSettings(**given, rpm_tolerance_pct=2.0))
    assert load_registered(path).speed == nominal.speed
    again = load_registered(path, RecordingSettings(rpm=1490.0))
    assert again.speed.source is SpeedSource.STATED  # the stored tolerance belongs to the stored speed


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"rpm_tolerance_pct": 1.0}, "--rpm.*at most 10 %"),
        ({"rpm": 1500.0, "rpm_tolerance_pct": 11.0}, "--rpm.*at most 10 %"),
        ({"derivative": 3}, "derivative 3 must be 1, of a velocity, or 2, of a position"),
        ({"resample_hz": 0.0}, "rate to resample to 0.0 must be a positive number"),
        ({"skip_s": -1.0}, "time to skip -1.0 must be a positive number"),
    ],
)
def test_impossible_settings(wrong, said):
    with pytest.raises(ConfigurationError, match=said):
        RecordingSettings(**wrong)


def test_a_table_of_labels(folder, srbval_json):
    """Files that it does not name are not registered; an empty field leaves the option of the command."""
    rows = ("a.npy;healthy;skf-6205;1480,5;2,5;data[2];25600;g", "b.npy;outer;skf-6205;1478;2,5;data[2];25600;")
    labels = labelled(folder, *rows)
    first, second = srbval_json("data", "add", folder, "--table", labels, "--unit", "m/s2")["recordings"]
    assert [Path(r["file"]).name for r in (first, second)] == ["a.npy", "b.npy"]
    assert (first["state"], first["bearing"], first["rpm"], first["radial_kn"]) == ("healthy", "skf-6205", 1480.5, 2.5)
    assert (first["settings"]["unit"], second["settings"]["unit"]) == ("g", "m/s2")
    assert (first["reason"], second["reason"]) == (None, None)
    faulty = load_registered(folder / "b.npy")
    assert (faulty.state, faulty.bearing, faulty.radial_n) == (Fault.OUTER, "skf-6205", 2500.0)
    assert (faulty.channel, Path(healthy_baseline(faulty).file).name) == ("data[2]", "a.npy")


def test_a_baseline_of_another_speed_load_bearing_or_channel_is_none(folder):
    same = GIVEN | {"channel": "data[1]", "rpm": 1480.0}
    add(folder / "b.npy", settings=RecordingSettings(**same, state=Fault.OUTER))
    for other in ({}, {"rpm": 1200.0}, {"bearing": "skf-6203"}, {"radial_kn": 1.0}, {"channel": "data[2]"}):
        add(folder / "a.npy", settings=RecordingSettings(**same | other, state=Fault.HEALTHY), repin=True)
        assert (healthy_baseline(load_registered(folder / "b.npy")) is None) == bool(other), other


WRONG_ROWS = ("a.npy;rusty;skf-6205;1;;;;", "none.npy;;;;;;;", "a.npy;outer;;fast;;;;", "a.npy;outer")
WRONG_ROWS += ("a.npy;;;1;;;;", "a.npy;;;2;;;;")


@pytest.mark.parametrize(
    ("header", "rows", "said"),
    [
        ("file;bearng", ("a.npy;x",), "unknown column 'bearng'; did you mean 'bearing'"),
        ("state", ("outer",), "'file' among them"),
        (
            HEADER,
            WRONG_ROWS,
            r"5 of 6 rows cannot be used: row 1: .*rusty.*row 2: .*none\.npy: no such file.*row 3: .*fast.*"
            r"row 4: 2 fields where the header has 8.*row 6: a\.npy is named twice",
        ),
        (HEADER, ("a.npy;;skf-9999;;;;;",), "bearing 'skf-9999' is not known"),
    ],
)
def test_all_that_is_wrong_with_a_table_at_once(folder, header, rows, said):
    with pytest.raises(ConfigurationError, match=said):
        add(folder, table=labelled(folder, *rows, header=header))
