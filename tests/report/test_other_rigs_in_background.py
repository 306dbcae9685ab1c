"""Recordings of other rigs read by a process of its own."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from srbval.comparison.other_rigs import read_other_rigs
from srbval.recordings.registry import RegisteredRecording, add
from srbval.report.findings import other_rigs_in_background
from srbval.report.findings.other_rigs_in_background import BackgroundReading


@pytest.fixture
def registered(tmp_path: Path) -> tuple[RegisteredRecording, ...]:
    rng = np.random.default_rng(0)
    for number in (105, 130):  # CWRU: inner race, outer race
        made = {f"X{number}_DE_time": rng.standard_normal((24_000, 1)), f"X{number}RPM": 1797.0}
        savemat(tmp_path / f"{number}.mat", made)
    return add(tmp_path).recordings


def test_it_gives_what_reading_here_gives_and_so_does_a_failed_process(
    registered: tuple[RegisteredRecording, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    here = read_other_rigs(registered)
    assert len(here) == 2
    assert BackgroundReading(registered).records() == here
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    assert BackgroundReading(registered).records() == here


def test_nothing_to_read_starts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(other_rigs_in_background, "WorkerProcess", None)
    assert BackgroundReading(()).records() == ()
