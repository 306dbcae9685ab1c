"""Stored results as the report shows them, and the wavelet transform that their trial chooses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbval.bench.scalogram_check import TRANSFORMS
from srbval.evidence.stored import ShownResult, chosen_transform, known_sensitivity, shown_result
from srbval.storage.stored_result import READING, SENSITIVITY, StoredResult


def trial(name: str, error: float, *, passed: bool) -> dict[str, Any]:
    return {"transform": name, "tone_error": 0.0, "impulse_error": error, "passed": passed}


def reading(*trials: dict[str, Any]) -> dict[str, ShownResult]:
    content = {"made_utc": "2026-01-01T00:00:00+00:00", "transforms": list(trials)}
    return {READING: shown_result(READING, StoredResult(path=Path("reading.json"), content=content))}


def test_the_first_transform_that_passes_draws_the_figure() -> None:
    trials = trial("a", 0.5, passed=False), trial("b", 0.002, passed=True), trial("c", 0.001, passed=True)
    assert chosen_transform(reading(*trials)) == "b"


def test_where_none_passes_the_smallest_error_decides() -> None:
    assert chosen_transform(reading(trial("a", 0.5, passed=False), trial("b", 0.1, passed=False))) == "b"


def test_without_a_trial_it_is_the_first_one_known() -> None:
    first = next(iter(TRANSFORMS))
    assert chosen_transform(reading()) == first
    assert chosen_transform({READING: shown_result(READING, None)}) == first


def test_nothing_stored_says_how_to_make_it() -> None:
    missing = shown_result(SENSITIVITY, None)
    assert (missing.content, missing.origin) == (None, None)
    assert missing.command == "srbval bench --sensitivity"
    assert known_sensitivity({SENSITIVITY: missing}).effects == ()
