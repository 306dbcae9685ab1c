"""The calibration table in a few rows: error against cost, one row a rung and question."""

from __future__ import annotations

from typing import Any

import numpy as np

from srbval.bench.ladder.questions import MEANING, Question
from srbval.bench.ladder.table import Calibration

REFERENCE_MODEL = "full"


def summary(table: Calibration) -> list[dict[str, Any]]:
    """One row for each question and rung: median and worst error [%] over the scenes asked, median cost.

    Scenes on which a rung gave no answer are counted, not averaged; without any answer the errors are None.
    """
    cost = {model: _median_cost(table, model) for model in table.models}
    return [_row(table, question, model, cost) for question in Question for model in table.models]


def _row(table: Calibration, question: Question, model: str, cost: dict[str, float | None]) -> dict[str, Any]:
    asked = [e.rungs[model] for e in table.entries if question in e.rungs[model].error_pct]
    errors = [e for e in (rung.error_pct[question] for rung in asked) if e is not None]
    own, full = cost[model], cost.get(REFERENCE_MODEL)
    return {
        "question": question.value,
        "title": MEANING[question].title,
        "error_of": MEANING[question].error_of,
        "model": model,
        "scenes": len(asked),
        "unanswered": len(asked) - len(errors),
        "median_error_pct": float(np.median(errors)) if errors else None,
        "worst_error_pct": max(errors) if errors else None,
        "wall_per_simulated_s": own,
        "cheaper_than_full": full / own if own and full else None,
    }


def _median_cost(table: Calibration, model: str) -> float | None:
    walls = [e.rungs[model].wall_per_simulated_s for e in table.entries]
    known = [wall for wall in walls if wall is not None]
    return float(np.median(known)) if known else None
