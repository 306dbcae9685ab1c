"""A table of features: a row per record with units in its names; what is missing has a reason."""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import srbval
from srbval.cli import run_command_line
from srbval.storage.installation import shipped_folder

EXCERPTS = shipped_folder("data_manifest") / "rig_excerpts"
FAULTY = EXCERPTS / "OR_877rpm_sample.h5"
BASE = ["file", "name", "channel", "bearing", "fs_hz", "seconds", "state", "speed_rpm", "band_low_hz", "band_high_hz"]
READERS = {"csv": pd.read_csv, "parquet": pd.read_parquet, "feather": pd.read_feather}


def test_a_row_per_record_of_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that cannot be read has a row too, a file that is no recording has none; the JSON has the same rows."""
    folder = tmp_path / "records"
    folder.mkdir()
    shutil.copy(FAULTY, folder)
    (folder / "broken.h5").write_bytes(b"no HDF5")
    (folder / "notes.md").write_text("of the rig")
    reading = srbval.read_record(srbval.RecordRequest(file=str(FAULTY))).to_dict()
    for ending, read in READERS.items():
        file = tmp_path / f"table.{ending}"
        assert run_command_line(["features", str(folder), "-o", str(file), "--json"]) == 3
        document, table = json.loads(capsys.readouterr().out), read(file)
        good, broken = document["features"]
        assert list(table) == list(good)
        assert list(good)[: len(BASE)] == BASE
        assert (good["state"], good["bearing"], good["channel"]) == ("outer", "skf-22240", "sensor_4")
        assert good["rms_m_s2"] == pytest.approx(reading["features"]["rms"])
        assert table["bpfo_harmonic_1_snr"][0] == pytest.approx(reading["lines"][0].snr)
        assert {name for name, value in broken.items() if value is not None} == {"file", "reason"}
        assert broken["reason"].startswith("a text file, but not a table of numbers")
        assert document["status"] == "incomplete"


def test_recordings_and_runs_in_their_order() -> None:
    """The same numbers as from the file; a record too short for lines, and one of unknown unit, have their reasons."""
    whole, noise = srbval.load_recording(FAULTY), np.random.default_rng(3).normal(size=2000)
    stated: dict[str, Any] = {"fs_hz": 20000.0, "rpm": 900, "bearing": "skf-6205", "state": "inner"}
    short = srbval.Recording.from_array(noise, unit="unknown", **stated)
    table = srbval.features([short, FAULTY, whole, short])
    assert table["name"].tolist() == ["recording", whole.name, whole.name, "recording"]
    numbers = table.select_dtypes("number")
    pd.testing.assert_series_equal(numbers.loc[1], numbers.loc[2], check_names=False)
    assert table["rms_m_s2"].isna().tolist() == [True, False, False, True]
    assert table["rms_unknown_unit"][0] == pytest.approx(noise.std())
    assert table["bpfi_harmonic_1_snr"].notna().all()
    assert table["bpfi_harmonic_2_snr"].isna().tolist() == [True, False, False, True]
    assert "no levels in m/s2: the unit is unknown; too short" in table["reason"][0]


@pytest.mark.parametrize(("name", "said"), [("t.xlsx", "CSV, Parquet or Feather"), ("t.parquet", "unlike a .csv file")])
def test_tables_that_cannot_be_written(
    name: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert run_command_line(["features", str(FAULTY), "-o", name]) == 2
    assert said in capsys.readouterr().err
