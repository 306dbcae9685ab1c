"""Bounds of a rung's error on a scene: the calibration scenes about it, and how far errors go beyond theirs."""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

import numpy as np

from srbval.bench.ladder.cases import CalibrationScene
from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import Entry, LadderCalibration

Key = tuple[str, str, Question]  # roller fit, model, question

SAME = 1e-9
AXES = ("rpm", "radial_kn", "height_mm")
# Of the upper half of the logarithms: three for one scene in some seven hundred, were they normal, and one more since
# the deviation itself is estimated from a dozen scenes.
DEVIATIONS = 4.0
LEAST_SCENES = 8  # that a margin is estimated from


def corners(entries: Iterable[Entry], case: CalibrationScene) -> list[Entry]:
    """The entries at the corners of the grid cell that holds `case`, clamped to the grid; empty without its kind and
    fit.
    """
    found = [e for e in entries if (e.case.kind, e.case.fit) == (case.kind, case.fit)]
    for axis in AXES:
        bracket = _bracket(known_values(found, axis), getattr(case, axis))
        found = [e for e in found if getattr(e.case, axis) in bracket]
    return found


def known_values(entries: Iterable[Entry], axis: str) -> list[float]:
    """The values of an axis, in ascending order."""
    return sorted({getattr(e.case, axis) for e in entries})


def _bracket(known: Sequence[float], value: float) -> set[float]:
    """The known values on either side of `value`; one value where it hits it or lies beyond."""
    low = max((k for k in known if k <= value + SAME), default=known[0] if known else value)
    high = min((k for k in known if k >= value - SAME), default=known[-1] if known else value)
    return {low, high}


def largest_error_pct(entries: Sequence[Entry], model: str, question: Question) -> float | None:
    """The largest error of a rung among the entries; None where any has no answer."""
    errors = [e.rungs[model].error_pct.get(question) if model in e.rungs else None for e in entries]
    known = [error for error in errors if error is not None]
    return max(known) if known and len(known) == len(errors) else None


@cache
def margins(calibration: LadderCalibration) -> Mapping[Key, float]:
    """For each roller fit, rung and question: the factor on the largest error at the corners; at least 1.

    The fits are kept apart because rollers rattle with play, while the ring rings with interference.

    From the ratios of measured to predicted errors on the scenes between: their median and `DEVIATIONS` times the
    deviation of the upper half from it, in logarithms, or the largest where that is more. Too few scenes with an answer
    give no margin.
    """
    seen: dict[Key, list[float]] = {}
    for entry in calibration.between:
        near = corners(calibration.entries, entry.case)
        for model in calibration.models:
            for question in entry.reference:
                ratio = _ratio(entry, near, model, question)
                if ratio is not None:
                    seen.setdefault((entry.case.fit, model, question), []).append(ratio)
    return {key: margin(ratios) for key, ratios in seen.items() if len(ratios) >= LEAST_SCENES}


def margin(ratios: Sequence[float]) -> float:
    """Factor that covers ratios of measured to predicted errors, and those to be expected beyond them."""
    logs = np.log(np.maximum(ratios, 1e-12))
    middle = float(np.median(logs))
    above = logs[logs >= middle] - middle
    spread = DEVIATIONS * math.sqrt(float(np.mean(above**2)))
    return max(1.0, float(np.max(ratios)), math.exp(middle + spread))


def _ratio(entry: Entry, near: Sequence[Entry], model: str, question: Question) -> float | None:
    measured = entry.rungs[model].error_pct.get(question)
    predicted = largest_error_pct(near, model, question)
    return measured / predicted if measured is not None and predicted else None
