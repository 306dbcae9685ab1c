"""The cell of the calibration grid that a scene lies in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from srbval.bench.ladder.cases import Case
from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import Entry

SAME = 1e-9
AXES = ("rpm", "radial_kn", "height_mm")


def corners(entries: Iterable[Entry], case: Case) -> list[Entry]:
    """The entries at the corners of the cell that holds `case`, clamped to the grid; empty without its kind and fit."""
    found = [e for e in entries if (e.case.kind, e.case.fit) == (case.kind, case.fit)]
    for axis in AXES:
        keep = _bracket(known_values(found, axis), getattr(case, axis))
        found = [e for e in found if getattr(e.case, axis) in keep]
    return found


def known_values(entries: Iterable[Entry], axis: str) -> list[float]:
    """The values of an axis, from low to high."""
    return sorted({getattr(e.case, axis) for e in entries})


def largest_error_pct(entries: Sequence[Entry], model: str, question: Question) -> float | None:
    """The largest error of a rung among the entries; None where any has no answer."""
    errors = [e.rungs[model].error_pct.get(question) if model in e.rungs else None for e in entries]
    known = [error for error in errors if error is not None]
    return max(known) if known and len(known) == len(errors) else None


def _bracket(known: Sequence[float], value: float) -> set[float]:
    """The entries either side of a value; the same where it hits one or lies beyond."""
    low = max((k for k in known if k <= value + SAME), default=known[0] if known else value)
    high = min((k for k in known if k >= value - SAME), default=known[-1] if known else value)
    return {low, high}
