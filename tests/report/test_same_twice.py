"""Two reports of the same recordings and seed are the same, byte for byte."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from srbval.storage.installation import child_environment

from .made import OPTIONS, PATTERN_SECONDS, Made

OF_THE_MACHINE = ("provenance",)
AGAIN = f"""
import sys
from srbval.cli import main
from srbval.report.findings import patterns
patterns.SECONDS = {PATTERN_SECONDS}  # as short as those of the first report
sys.exit(main(sys.argv[1:]) not in (0, 1))
"""


@pytest.fixture(scope="module")
def twice(with_rig: Made, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The report made here, and once more by another process, which hashes its own way."""
    home = tmp_path_factory.mktemp("again")
    own = os.environ | child_environment() | {"SRBVAL_HOME": str(home), "PYTHONHASHSEED": "1"}
    own.pop("SRBVAL_RECORDINGS", None)
    subprocess.run([sys.executable, "-c", AGAIN, *OPTIONS], cwd=home, capture_output=True, check=True, env=own)
    return [with_rig.folder, home / "made"]


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
