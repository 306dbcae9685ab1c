"""How far a rung's error goes beyond those of the calibration scenes about it: from scenes drawn between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import Calibration, Entry
from srbval.plan.corners import corners, largest_error_pct

Key = tuple[str, str, Question]  # roller fit, model, question

# Of the upper half of the logarithms: three for one scene in some seven hundred, were they normal, and one more since
# the deviation itself is read from a dozen scenes.
DEVIATIONS = 4.0
LEAST_SCENES = 8  # to tell a margin from


@cache
def margins(calibration: Calibration) -> Mapping[Key, float]:
    """For each roller fit, rung and question: by how much its error at the corners is to be multiplied; at least 1.

    The fits are kept apart since with play rollers rattle, with interference the ring rings.

    Measured over predicted on the scenes between: their median and `DEVIATIONS` times the deviation of the upper half
    from it, in logarithms, or the largest where that is more. Too few scenes with an answer give no margin.
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
    reach = DEVIATIONS * math.sqrt(float(np.mean(above**2)))
    return max(1.0, float(np.max(ratios)), math.exp(middle + reach))


def _ratio(entry: Entry, near: Sequence[Entry], model: str, question: Question) -> float | None:
    measured = entry.rungs[model].error_pct.get(question)
    predicted = largest_error_pct(near, model, question)
    return measured / predicted if measured is not None and predicted else None
