"""The stored comparison of the ball bearing model with the records: whole, by its command, and as the guide says it."""

from pathlib import Path

import pytest

import srbval
from srbval.storage.stored_result import newest_result

GUIDE = (Path(srbval.__file__).parent / "docs" / "guide" / "your_bearing.md").read_text(encoding="utf-8")
SETS = {"cwru": "CWRU", "mfpt": "MFPT", "hit-sm": "HIT-SM"}
QUANTITIES = ("cage ratio [%]", "2nd [dB]", "3rd [dB]", "4th [dB]", "sidebands [dB]")


@pytest.fixture(scope="module")
def stored() -> dict:
    found = newest_result("ball_records")
    return found.content


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
