"""Predictions held against measurements on scenes that the calibration has not seen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from srbval.bench.ladder.cases import Case
from srbval.bench.ladder.measure import measure_case
from srbval.bench.ladder.questions import Question, asked_of
from srbval.bench.ladder.table import Calibration
from srbval.plan.plan import make_plan
from srbval.scene import DefectKind


@dataclass(frozen=True, kw_only=True)
class Check:
    """A rung called enough on a held-out scene: predicted and measured error [%]; measured None: no answer."""

    case: Case
    question: Question
    model: str
    tolerance_pct: float
    predicted_pct: float
    measured_pct: float | None

    @property
    def within_twice(self) -> bool:
        """Is the measured error at most twice the predicted one?"""
        return self.measured_pct is not None and self.measured_pct <= 2 * self.predicted_pct

    @property
    def within_tolerance(self) -> bool:
        """Does the rung keep what it was called enough for?"""
        return self.measured_pct is not None and self.measured_pct <= self.tolerance_pct


def check_case(
    case: Case, tolerances: dict[Question, float], calibration: Calibration, *, folder: Path | None = None
) -> list[Check]:
    """Every rung that is called enough for a question at its tolerance, on one scene."""
    seconds = calibration.seconds
    found = []
    asked = [q for q in tolerances if q in asked_of(DefectKind(case.kind))]
    for question in asked:
        plan = make_plan(
            case.scene("full", seconds=seconds), question=question, tolerance_pct=tolerances[question],
            calibration=calibration,
        )  # fmt: skip
        found += [(question, c) for c in plan.candidates if c.ok and c.error_pct is not None]
    models = [m for m in calibration.models if any(c.model == m for _, c in found)]
    entry = measure_case(case, models=models, seconds=seconds, folder=folder)
    return [
        Check(
            case=case, question=question, model=c.model, tolerance_pct=tolerances[question],
            predicted_pct=c.error_pct or 0.0, measured_pct=entry.rungs[c.model].error_pct[question],
        )
        for question, c in found
    ]  # fmt: skip
