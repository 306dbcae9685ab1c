"""Two reports of the same recordings and seed are the same, byte for byte."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from srbval.storage.own_package import child_environment

SECONDS = "1"
OF_THE_MACHINE = ("provenance",)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two reports, made by two processes at the same time: each hashes its own way and shares its cores."""
    homes = [tmp_path_factory.mktemp(name) for name in ("first", "second")]
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "srbval", "report", "--seconds", SECONDS, "--no-pdf", "-o", "made"],
            cwd=home, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            env=os.environ | child_environment() | {"SRBVAL_HOME": str(home), "PYTHONHASHSEED": str(seed)},
        )
        for seed, home in enumerate(homes)
    ]  # fmt: skip
    assert [process.wait() for process in processes] == [0, 0]
    return [home / "made" for home in homes]


def document(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.slow
def test_the_numbers_are_the_same(twice: list[Path]) -> None:
    first, second = ({k: v for k, v in document(folder).items() if k not in OF_THE_MACHINE} for folder in twice)
    assert json.dumps(first) == json.dumps(second)


@pytest.mark.slow
def test_so_are_the_bytes_on_one_machine(twice: list[Path]) -> None:
    first, second = ((folder / "report.json").read_bytes() for folder in twice)
    assert first == second


@pytest.mark.slow
def test_the_figures_are_the_same(twice: list[Path]) -> None:
    first, second = ({p.name: p.read_bytes() for p in (folder / "figures").iterdir()} for folder in twice)
    assert first
    assert first == second
