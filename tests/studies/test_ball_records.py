"""The stored comparison of the ball bearing model with the records: whole, by its command, and as the guide says it."""

import math
import statistics
from pathlib import Path

import pytest

import srbval
from srbval.storage.stored_result import newest_result
from srbval.studies.ball_records.study import LEAST_RECORDS

GUIDE = (Path(srbval.__file__).parent / "docs" / "guide" / "your_bearing.md").read_text(encoding="utf-8")
SETS = {"cwru": "CWRU", "mfpt": "MFPT", "hit-sm": "HIT-SM"}
QUANTITIES = ("cage ratio [%]", "2nd [dB]", "3rd [dB]", "4th [dB]", "sidebands [dB]")


@pytest.fixture(scope="module")
def stored() -> dict:
    found = newest_result("ball_records")
    return found.content


def test_it_says_by_which_command_it_was_made(stored: dict) -> None:
    assert "dirty" not in stored["git_revision"]
    assert set(SETS) == {row["dataset"] for row in stored["rows"]}


def test_the_summary_is_that_of_its_rows(stored: dict) -> None:
    for one in stored["summary"]:
        own = [r for r in stored["rows"] if (r["dataset"], r["quantity"]) == (one["dataset"], one["quantity"])]
        errors = [row["error"] for row in own]
        assert one["records"] == len(own)
        assert one["bias"] == pytest.approx(statistics.fmean(errors))
        assert one["within"] == sum(abs(row["error"]) <= row["uncertainty"] for row in own)
        assert (one["ci95"] is None) == (len(own) < LEAST_RECORDS)
    for row in stored["rows"]:
        assert row["uncertainty"] == pytest.approx(math.hypot(row["reading"], row["speed"], row["inputs"]))


def test_the_guides_table_is_the_stored_one(stored: dict) -> None:
    found = {(one["dataset"], one["quantity"]): one for one in stored["summary"]}
    for name, title in SETS.items():
        cells = []
        for quantity in QUANTITIES:
            one = found[name, quantity]
            digits = 2 if "%" in quantity else 0
            half = "" if one["ci95"] is None else f" ± {one['ci95']:.{digits}f}"
            cells.append(f"{one['bias']:+.{digits}f}{half} ({one['within']} of {one['records']})")
        assert f"| {title} | {' | '.join(cells)} |" in GUIDE
