"""A whole campaign of measurements registered from a table; everything open or wrong is said at once."""

import json
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.cli import main
from srbval.errors import ConfigurationError
from srbval.recordings import RecordingSettings
from srbval.recordings.registry import add, healthy_baseline, load_registered

from . import files

HEADER = "file;state;bearing;rpm;radial_kn;channel;fs;unit"


def folder_of(tmp_path: Path, *names: str) -> Path:
    (tmp_path / "rig").mkdir()
    for i, name in enumerate(names):
        np.save(
            tmp_path / "rig" / name, np.stack([files.vibration(seed=2 * i), files.vibration(seed=2 * i + 1)], axis=1)
        )
    return tmp_path / "rig"


def labelled(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder.parent / "labels.csv"
    path.write_text("\n".join(["\ufeff" + header, *rows]) + "\n", encoding="utf-8")
    return path


def test_a_campaign_is_registered_and_remembered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(tmp_path, "a.npy", "b.npy", "notes.npy")
    labels = labelled(
        folder, "a.npy;healthy;skf-6205;1480,5;2,5;data[2];25600;g", "b.npy;outer;skf-6205;1478;2,5;data[2];25600;"
    )
    assert main(["data", "add", str(folder), "--table", str(labels), "--unit", "m/s2", "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["recordings"]
    assert [Path(r["file"]).name for r in (first, second)] == ["a.npy", "b.npy"]
    assert (first["state"], first["bearing"], first["rpm"], first["radial_kn"]) == ("healthy", "skf-6205", 1480.5, 2.5)
    assert (first["settings"]["unit"], second["settings"]["unit"]) == ("g", "m/s2")  # the row's, else the option's
    assert (first["reason"], second["reason"]) == (None, None)
    faulty = load_registered(folder / "b.npy")
    assert (faulty.state, faulty.bearing, faulty.radial_n, faulty.channel) == (
        Fault.OUTER,
        "skf-6205",
        2500.0,
        "data[2]",
    )
    baseline = healthy_baseline(faulty)
    assert Path(baseline.file).name == "a.npy"


def test_a_baseline_of_another_speed_load_bearing_or_folder_is_none(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, "a.npy", "b.npy")
    same = {"bearing": "skf-6205", "fs_hz": 25600.0, "unit": "g", "channel": "data[1]", "rpm": 1480.0}
    add(folder / "b.npy", settings=RecordingSettings(**same, state=Fault.OUTER))
    for other in ({}, {"rpm": 1200.0}, {"bearing": "skf-6203"}, {"radial_kn": 1.0}, {"channel": "data[2]"}):
        add(folder / "a.npy", settings=RecordingSettings(**same | other, state=Fault.HEALTHY), repin=True)
        assert (healthy_baseline(load_registered(folder / "b.npy")) is None) == bool(other), other


def test_all_that_is_wrong_with_a_table_at_once(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, "a.npy")
    with pytest.raises(ConfigurationError, match=r"unknown column 'bearng'; did you mean 'bearing'"):
        add(folder, table=labelled(folder, "a.npy;x", header="file;bearng"))
    with pytest.raises(ConfigurationError, match="'file' among them"):
        add(folder, table=labelled(folder, "outer", header="state"))
    rows = [
        "a.npy;rusty;skf-6205;1;;;;",
        "none.npy;;;;;;;",
        "a.npy;outer;;fast;;;;",
        "a.npy;outer",
        "a.npy;;;1;;;;",
        "a.npy;;;2;;;;",
    ]
    with pytest.raises(
        ConfigurationError,
        match=r"5 of 6 rows cannot be used: row 1: .*rusty.*row 2: .*none\.npy: no such file.*row 3: .*fast.*"
        r"row 4: 2 fields where the header has 8.*row 6: a\.npy is named twice",
    ):
        add(folder, table=labelled(folder, *rows))
    with pytest.raises(ConfigurationError, match="bearing 'skf-9999' is not known"):
        add(folder, table=labelled(folder, "a.npy;;skf-9999;;;;;"))
