"""The calibration table: errors and costs of every rung on every calibration scene; its JSON file, its summary."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.models.hierarchy import level_of
from srbval.plan.cases import BASES, CalibrationScene
from srbval.plan.questions import MEANING, Answer, Question
from srbval.storage.files import read_limited
from srbval.storage.json_files import parse_json

SCHEMA_VERSION = 3
MOST_BYTES = 2**26
LEAST_SHARE = 0.9  # of scenes on which a rung must be near, as the planner's bounds hold on nine in ten


@dataclass(frozen=True, kw_only=True)
class Answered:
    """A run's answers (None or left out: none) and its cost: the wall time of the solution, as `Run.wall_s`, times the
    share of a core that the process had, so that other work does not count.
    """

    status: str
    wall_per_simulated_s: float | None
    answers: Mapping[Question, Answer | None]


@dataclass(frozen=True, kw_only=True)
class RungEntry(Answered):
    """A rung on a scene, with the errors of its answers [%]; None: no answer."""

    error_pct: Mapping[Question, float | None]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One calibration scene: the reference's answers and every rung's."""

    case: CalibrationScene
    reference: Mapping[Question, Answer | None]
    rungs: Mapping[str, RungEntry]

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON, the scene's values flat."""
        return {**vars(self.case), "reference": self.reference, "rungs": self.rungs}


@dataclass(frozen=True, kw_only=True, eq=False)
class LadderCalibration:
    """The table; `seconds` recorded in each run; `solver` and `step_s` of the models that have no method of their own.

    `base`: the bundled scene that all others differ from in a few values.

    `entries` are those of the grid; `between`, scenes drawn within it, tell how far errors go beyond the grid's.
    """

    base: str
    reference: str
    solver: str
    step_s: float
    seconds: float
    machine: Mapping[str, Any]
    entries: tuple[Entry, ...]
    between: tuple[Entry, ...]

    @property
    def reference_model(self) -> str:
        """The rung that is right, at half its step."""
        return BASES[self.base].reference

    @property
    def models(self) -> tuple[str, ...]:
        """Rungs, in the order of the ladder: cheapest first."""
        return tuple(self.entries[0].rungs)

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return {"schema_version": SCHEMA_VERSION, **vars(self)}


def load_calibration(path: Path) -> LadderCalibration:
    """Read a table; `DataError` naming the file where it is missing or is none."""
    try:
        table = parse_json(read_limited(path, MOST_BYTES))
        found = LadderCalibration(
            **{name: table[name] for name in ("base", "reference", "solver", "step_s", "seconds", "machine")},
            entries=tuple(_entry(e) for e in table["entries"]),
            between=tuple(_entry(e) for e in table["between"]),
        )
        if {entry.case.base for entry in (*found.entries, *found.between)} != {BASES[found.base].name}:
            raise ValueError("scenes of another base")
        if not (summary(found) and math.isfinite(found.seconds + found.step_s)):  # every number is one
            raise ValueError("no scenes")
        return found
    except (ArithmeticError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise DataError(
            f"{path}: not a calibration table ({error!r}). Measure one: srbval study run model_hierarchy -o {path.name}"
        ) from error


def _entry(table: Mapping[str, Any]) -> Entry:
    case = CalibrationScene(**{field.name: table[field.name] for field in fields(CalibrationScene)})
    if not math.isfinite(case.rpm + case.radial_kn + case.height_mm):
        raise ValueError(f"no scene: {case}")
    return Entry(
        case=case,
        reference=read_answers(table["reference"]),
        rungs={
            model: RungEntry(
                **rung
                | {
                    "answers": read_answers(rung["answers"]),
                    "error_pct": {Question(q): e for q, e in rung["error_pct"].items()},
                }
            )
            for model, rung in table["rungs"].items()
        },
    )


def read_answers(table: Mapping[str, Any]) -> dict[Question, Answer | None]:
    """The answers that a JSON object holds."""
    return {Question(q): None if a is None else tuple(a) for q, a in table.items()}


def summary(table: LadderCalibration) -> list[dict[str, Any]]:
    """One row for each question and rung: median and worst error over the grid's scenes asked, median cost.

    Scenes on which a rung gave no answer are counted, not averaged; without any answer the errors are None. Of an
    amplitude: on how many of all scenes, those between the grid's too, the rung is `near`, within its margin, with the
    95 % interval of that share; None where it cannot answer. `least`: the cheapest that is near on `LEAST_SHARE`.
    """
    cost = {model: _median_cost(table, model) for model in table.models}
    rows = [_row(table, question, model, cost) for question in Question for model in table.models]
    enough = [row for row in rows if row["near"] and row["near"] >= LEAST_SHARE * row["near_of"]]
    least = {row["question"]: row["model"] for row in reversed(enough)}
    return [row | {"least": least.get(row["question"]) == row["model"]} for row in rows]


def _row(table: LadderCalibration, question: Question, model: str, cost: dict[str, float | None]) -> dict[str, Any]:
    from scipy.stats import binomtest  # takes a while to load, and plans need no summary

    asked = [e.rungs[model] for e in table.entries if question in e.rungs[model].error_pct]
    errors = [e for e in (rung.error_pct[question] for rung in asked) if e is not None]
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


def _near(table: LadderCalibration, question: Question, model: str) -> tuple[int | None, int]:
    """On how many scenes a rung is within the margin of an amplitude, of those on which the reference shows it."""
    margin = MEANING[question].margin_pct
    if margin is None or question.value in level_of(model).lacks:
        return None, 0
    shown = [e for e in (*table.entries, *table.between) if e.reference.get(question) is not None]
    errors = [e.rungs[model].error_pct[question] for e in shown]
    return sum(error is not None and error <= margin for error in errors), len(errors)


def _median_cost(table: LadderCalibration, model: str) -> float | None:
    walls = [e.rungs[model].wall_per_simulated_s for e in table.entries]
    known = [wall for wall in walls if wall is not None]
    return float(np.median(known)) if known else None
