"""Known data sets: what a file holds and nobody reads, and what it says twice and differently, is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

from srbval.recordings import load_recording

from . import files


def test_a_name_that_the_list_of_records_contradicts(tmp_path: Path) -> None:
    path = files.cwru(tmp_path / "105_OR007at6_0_12kDE.mat", "105")
    assert load_recording(path).cautions == (
        "its name says OR007, the data set's list IR007 for record 105: the name is used",
    )
    assert load_recording(files.cwru(tmp_path / "105_IR007_0_12kDE.mat", "105")).cautions == ()


def test_records_and_signals_left_out(tmp_path: Path) -> None:
    both = {f"X{n}_DE_time": files.vibration()[:, None] for n in ("098", "099")}
    savemat(tmp_path / "99.mat", both)
    assert "left out: signals of record 098" in load_recording(tmp_path / "99.mat", rpm=1797).notes
    path = files.rig_v5(tmp_path / "IR_727rpm_124.8kN_0kN.mat", files.rig_signals())
    assert "left out: Signal_1 (°C)" in load_recording(path).notes


def test_a_unit_that_is_not_known(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"x": np.array(files.vibration()), "fs": 8000.0, "unit": "furlong/s2"})
    assert "left out: unit 'furlong/s2', which is not known" in load_recording(tmp_path / "a.mat", unit="g").notes
