"""The notebooks' numbers: each notebook is run cell by cell, and its results are checked.

These tests are of the long form: `.ci/run` executes all notebooks with nbval, which compares the stored output.
"""

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

from srbval.diagnosis.fault_verdict import Finding

FOLDER = Path(__file__).parents[1] / "notebooks"
NAMES = ("first_tour", "reproducing_table6", "speed_against_accuracy", "your_own_recordings")
CHECKED = "nbval-check-output"
# Lines of the model lie within this of the cage speed's; two seconds are read to 0.05 Hz.
READ_HZ = 0.1
PRINTED_RATIO = 5e-4  # the cage ratio of the outer-race run is 0.4314 to 0.4317, by record length
PRINTED_RPM, ROLLERS = 0.05, 0.02  # as the notebook prints them
CAGE_ERROR = 2e-5  # between the default solver's and the paper's own in the stored bench
BPFO_ORDER, BPFO_HZ = 3.585, 0.01  # of the recording made in the notebook, and its interval


def cells(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return found


def run(name: str) -> dict[str, Any]:
    """Run a notebook's code and return the names that it defines."""
    space: dict[str, Any] = {}
    with mpl.rc_context({"backend": "agg"}):
        for cell in cells(name):
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), f"{name}, {cell['id']}", "exec"), space)
    return space


def test_these_are_all_there_are() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_checked_cells_are_tagged_and_stored_with_their_output(name: str) -> None:
    checked = [cell for cell in cells(name) if CHECKED in cell["metadata"].get("tags", ())]
    assert len(checked) >= 2  # digits that differ from one processor to the next are asserted below, not compared
    assert all(cell["outputs"] for cell in checked)
    text = json.dumps(cells(name))
    assert "Traceback" not in text
    assert "/tmp/" not in text


@pytest.mark.long_form
def test_first_tour() -> None:
    found = run("first_tour")
    assert found["line"].found_hz == pytest.approx(found["run"].bpfo_hz, abs=READ_HZ)
    assert found["run"].cage_ratio == pytest.approx(0.4317, abs=PRINTED_RATIO)
    assert found["line"].detected


@pytest.mark.long_form
def test_reproducing_table6() -> None:
    found = run("reproducing_table6")
    assert found["implied_rpm"] == pytest.approx(706.6, abs=PRINTED_RPM)
    assert found["total"] == pytest.approx(19, abs=ROLLERS)
    assert 0.2 < found["deviation_pct"]["BPFO"] < 0.35
    assert -0.25 < found["deviation_pct"]["BPFI"] < -0.05
    assert all(line.ci95_hz < READ_HZ for line in found["lines"].values())


@pytest.mark.long_form
def test_speed_against_accuracy() -> None:
    rows = run("speed_against_accuracy")["rows"]
    assert rows["imex2"]["cage_error"] < CAGE_ERROR < rows["ode4"]["cage_error"]
    assert rows["ode4"]["floor"] > 6
    assert rows["imex2"]["floor"] < 3


@pytest.mark.long_form
def test_your_own_recordings() -> None:
    found = run("your_own_recordings")
    assert found["line"].found_hz == pytest.approx(BPFO_ORDER * 1480 / 60, abs=BPFO_HZ)
    assert found["line"].detected
    assert not found["analysis"].line("BPFI").detected
    assert found["verdict"].finding is Finding.UNDECIDED
