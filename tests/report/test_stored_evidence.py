"""Stored results as the report shows them."""

from __future__ import annotations

from srbval.report.findings.stored import known_sensitivity, shown_result
from srbval.storage.stored_result import SENSITIVITY


def test_nothing_stored_says_how_to_make_it() -> None:
    missing = shown_result(SENSITIVITY, None)
    assert (missing.content, missing.origin) == (None, None)
    assert missing.command == "srbval bench --sensitivity"
    assert known_sensitivity({SENSITIVITY: missing}).defects == ()
