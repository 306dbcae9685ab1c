"""Stored results as the report shows them."""

from __future__ import annotations

from srbval.report.findings.stored import known_sensitivity, shown_result


def test_nothing_stored_says_how_to_make_it() -> None:
    missing = shown_result("sensitivity", None)
    assert (missing.content, missing.origin) == (None, None)
    assert missing.command == "srbval bench --sensitivity"
    assert known_sensitivity({"sensitivity": missing}).defects == ()
