"""The notebooks are whole: `.ci/run` executes them all with nbval, which compares the stored output of tagged cells."""

import json
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NAMES = ("first_tour", "reproducing_table6", "speed_against_accuracy", "your_own_recordings")
CHECKED = "nbval-check-output"


def cells(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return found


def test_these_are_all_there_are():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_checked_cells_are_tagged_and_stored_with_their_output(name):
    checked = [cell for cell in cells(name) if CHECKED in cell["metadata"].get("tags", ())]
    assert len(checked) >= 2
    assert all(cell["outputs"] for cell in checked)
    text = json.dumps(cells(name))
    assert "Traceback" not in text
    assert "/tmp/" not in text
