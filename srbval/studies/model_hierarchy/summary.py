"""The table of errors and costs in short: a row for each question and model."""

from typing import Any

import numpy as np
from scipy.stats import binomtest

from srbval.models.hierarchy import level_of
from srbval.plan.questions import MEANING, Question
from srbval.plan.table import CalibrationTable

LEAST_SHARE = 0.9  # of scenes on which a model must be near, as the planner's bounds hold on nine in ten


def summary(table: CalibrationTable) -> list[dict[str, Any]]:
    """One row for each question and model: median and worst error over the grid's scenes asked, median cost.

    Scenes on which a model gave no answer are counted, not averaged; without any answer the errors are None. Of an
    amplitude: on how many of all scenes, those between the grid's too, the model is `near`, within its margin, with the
    95 % interval of that share; None where it cannot answer. `least`: the cheapest that is near on `LEAST_SHARE`.
    """
    cost = {model: _median_cost(table, model) for model in table.models}
    rows = [_row(table, question, model, cost) for question in Question for model in table.models]
    enough = [row for row in rows if row["near"] and row["near"] >= LEAST_SHARE * row["near_of"]]
    least = {row["question"]: row["model"] for row in reversed(enough)}
    return [row | {"least": least.get(row["question"]) == row["model"]} for row in rows]


def _row(table: CalibrationTable, question: Question, model: str, cost: dict[str, float | None]) -> dict[str, Any]:
    asked = [e.levels[model] for e in table.entries if question in e.levels[model].error_pct]
    errors = [e for e in (level.error_pct[question] for level in asked) if e is not None]
    own, full, meaning = cost[model], cost.get("full"), MEANING[question]
    median, worst = (float(np.median(errors)), max(errors)) if errors else (None, None)
    near, of = _near(table, question, model)
    return {
        "question": question.value,
        "title": meaning.title,
        "error_of": meaning.error_of,
        "model": model,
        "scenes": len(asked),
        "unanswered": len(asked) - len(errors),
        "median_error_pct": median,
        "worst_error_pct": worst,
        "unit": meaning.unit,
        "median_error": None if median is None else meaning.shown(median),
        "worst_error": None if worst is None else meaning.shown(worst),
        "margin": meaning.margin_pct and meaning.shown(meaning.margin_pct),
        "near": near,
        "near_of": of,
        "near_ci95": None if near is None or not of else tuple(binomtest(near, of).proportion_ci(method="wilson")),
        "wall_per_simulated_s": own,
        "cheaper_than_full": full / own if own and full else None,
    }


def _near(table: CalibrationTable, question: Question, model: str) -> tuple[int | None, int]:
    """On how many scenes a model is within the margin of an amplitude, of those on which the reference shows it."""
    margin = MEANING[question].margin_pct
    if margin is None or question.value in level_of(model).lacks:
        return None, 0
    shown = [e for e in (*table.entries, *table.between) if e.reference.get(question) is not None]
    errors = [e.levels[model].error_pct[question] for e in shown]
    return sum(error is not None and error <= margin for error in errors), len(errors)


def _median_cost(table: CalibrationTable, model: str) -> float | None:
    walls = [e.levels[model].wall_per_simulated_s for e in table.entries]
    known = [wall for wall in walls if wall is not None]
    return float(np.median(known)) if known else None
