"""Shared fixtures: where the measured recordings are, and a home of its own for every test."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings_dir() -> Path:
    """Folder of measured recordings, from SRBVAL_RECORDINGS; skips visibly where it is not set."""
    folder = os.environ.get("SRBVAL_RECORDINGS")
    if not folder or not Path(folder).is_dir():
        pytest.skip("SRBVAL_RECORDINGS does not name a folder of measured recordings")
    return Path(folder)


@pytest.fixture(scope="session", autouse=True)
def _compiled_kernels() -> None:
    """Compile the full model's kernels in a process that then ends.

    One that has compiled them gives other last digits than one that loads them, and some tests compare both.
    """
    code = "import srbval; srbval.simulate(srbval.paper_scene(duration='1 ms', settle='0 s'))"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture(autouse=True)
def _own_home(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the user's manifest and recordings out of the tests, and the tests out of the user's manifest."""
    monkeypatch.delenv("SRBVAL_RECORDINGS", raising=False)
    monkeypatch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
