"""Recordings of other rigs read by a process of its own."""

from __future__ import annotations

import gc
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from srbval.recordings.registry import RegisteredRecording, add
from srbval.validation.other_rigs import read_other_rigs
from srbval.validation.other_rigs_aside import ReadAside, read_aside


@pytest.fixture
def registered(tmp_path: Path) -> tuple[RegisteredRecording, ...]:
    rng = np.random.default_rng(0)
    for number in (105, 130):  # CWRU: inner race, outer race
        made = {f"X{number}_DE_time": rng.standard_normal((24_000, 1)), f"X{number}RPM": 1797.0}
        savemat(tmp_path / f"{number}.mat", made)
    return add(tmp_path).recordings


def test_it_gives_what_reading_here_gives(registered: tuple[RegisteredRecording, ...]) -> None:
    aside = read_aside(registered)
    here = read_other_rigs(registered)
    assert len(aside) == len(here) == 2
    assert tuple(aside) == here
    assert aside[-1] == here[-1]


def test_nothing_to_read_starts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    assert read_aside(()) == ()


def test_a_process_that_fails_is_made_up_for(
    registered: tuple[RegisteredRecording, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    assert tuple(read_aside(registered)) == read_other_rigs(registered)


def test_nobody_waits_for_what_nobody_looks_at(registered: tuple[RegisteredRecording, ...]) -> None:
    aside = ReadAside(registered, 1)
    process = aside._process
    del aside
    gc.collect()
    assert process.wait(timeout=60) != 0
