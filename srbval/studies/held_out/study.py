"""The planner's predicted errors against measured ones on new scenes.

The scenes were used neither for the calibration nor for its margins. A check is a mapping, as it is stored: a model on
such a scene with its predicted and its measured error [%], None where it gave no answer; `coverage` is the chance that
the prediction states for being a bound, `tolerances_pct` those of `TOLERANCES_PCT` at which the model was called
enough, `broken_pct` those of them at which it was not, `chosen_pct` those at which it was the planner's choice.
"""

from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.models.hierarchy import level_of
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.plan import VACUOUS_PCT, make_plan
from srbval.plan.questions import MEANING, Question, asked_of
from srbval.plan.table import CalibrationScene, CalibrationTable, Entry
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import newest_result
from srbval.studies.calibration_runs import drawn, measure_cases
from srbval.studies.harness import StudyResult

SEED = 5  # of the scenes, not that of those between the calibration's
# Tolerances at which each prediction is put to the test.
TOLERANCES_PCT = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
Row = Mapping[str, Any]


def held_out() -> list[CalibrationScene]:
    """Random scenes within the grid from another seed; no constant of the planner may be tuned to these."""
    return drawn(SEED, power=2)


def check_cases(
    cases: Sequence[CalibrationScene],
    calibration: CalibrationTable,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
) -> list[Row]:
    """Every prediction for every one of `cases`, measured; the reference must have an answer to measure against.

    `jobs`: see `measure_cases`.
    """
    entries = measure_cases(cases, models=calibration.models, seconds=calibration.seconds, jobs=jobs, progress=progress)
    return [check for entry in entries for check in checks_of(entry, calibration)]


def checks_of(entry: Entry, calibration: CalibrationTable) -> Iterator[Row]:
    """Every prediction for the scene of a measured entry."""
    for question in asked_of(Fault(entry.case.kind)):
        if entry.reference.get(question) is not None:
            measured = {model: rung.error_pct[question] for model, rung in entry.levels.items()}
            yield from _checks(entry.case, question, measured, calibration)


def checks_again(stored: Iterable[Row], calibration: CalibrationTable) -> list[Row]:
    """Stored checks with the predictions that the planner makes now, compared with the errors measured then."""
    measured: dict[tuple[CalibrationScene, Question], dict[str, float | None]] = {}
    for row in stored:
        key = CalibrationScene(**row["case"]), Question(row["question"])
        measured.setdefault(key, {})[row["model"]] = row["measured_pct"]
    return [check for key, errors in measured.items() for check in _checks(*key, errors, calibration)]


def _checks(
    case: CalibrationScene, question: Question, measured: Mapping[str, float | None], calibration: CalibrationTable
) -> Iterator[Row]:
    scene = case.scene("full", seconds=calibration.seconds)
    plans = [
        make_plan(scene, question=question, tolerance_pct=tolerance, calibration=calibration)
        for tolerance in TOLERANCES_PCT
    ]
    for number, one in enumerate(plans[0].candidates):
        if one.error_pct is not None and question.value not in level_of(one.model).lacks:
            enough = [plan.tolerance_pct for plan in plans if plan.candidates[number].ok]
            chosen = [plan.tolerance_pct for plan in plans if plan.met and plan.chosen == one.model]
            yield check(
                case, question, one.model, one.error_pct, measured[one.model], coverage=one.coverage or 0.0,
                tolerances_pct=enough, chosen_pct=chosen,
            )  # fmt: skip


def check(
    case: CalibrationScene, question: Question, model: str, predicted_pct: float, measured_pct: float | None, **of: Any
) -> Row:
    """One check; `within`: the measured error is at most the predicted one, which is meant as a bound."""
    measured = np.inf if measured_pct is None else measured_pct
    return {
        "case": case, "question": question, "model": model, "predicted_pct": predicted_pct,
        "measured_pct": measured_pct, **of, "scene": case.name, "within": measured <= predicted_pct,
        "within_twice": measured <= 2 * predicted_pct,
        "broken_pct": [tolerance for tolerance in of["tolerances_pct"] if measured > tolerance],
    }  # fmt: skip


def tallies(checks: Sequence[Row]) -> list[dict[str, Any]]:
    """One row per question, and one for all of them (`question` None).

    `scenes`: those with a prediction; `scenes_within_twice`: those where every model's measured error is within twice
    the predicted one. `predictions`: one per scene and model; `coverage`: the mean chance that they state, `vacuous`:
    those of 100 % and more. `promises`: how often a model was called enough at a tolerance; `broken`: how often it was
    not.
    """
    rows = []
    for question in (*Question, None):
        own = [c for c in checks if question in (None, c["question"])]
        scenes, missed = {c["scene"] for c in own}, {c["scene"] for c in own if not c["within_twice"]}
        rows.append({
            "question": question and question.value, "title": MEANING[question].title if question else "all questions",
            "scenes": len(scenes), "scenes_within_twice": len(scenes - missed), "predictions": len(own),
            "within": sum(c["within"] for c in own),
            "coverage": float(np.mean([c["coverage"] for c in own])) if own else 0.0,
            "vacuous": sum(c["predicted_pct"] >= VACUOUS_PCT for c in own),
            "within_twice": sum(c["within_twice"] for c in own),
            "unanswered": sum(c["measured_pct"] is None for c in own),
            "promises": sum(len(c["tolerances_pct"]) for c in own), "broken": sum(len(c["broken_pct"]) for c in own),
        })  # fmt: skip
    return rows


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    calibration, kept, ran = shipped_calibration(), newest_result("held_out"), dict[str, Any]()
    if options.judge_again and kept is not None:
        checks = checks_again(kept.content["checks"], calibration)
        ran = {"runs_of": kept.content.get("runs_of", kept.origin)}
    else:
        checks = check_cases(held_out(), calibration, jobs=options.jobs, progress=progress)
    rows = tallies(checks)
    content = {"seconds": calibration.seconds, "reference": calibration.reference, "tallies": rows, "checks": checks}
    return StudyResult(name="held_out", content=ran | to_json(content), text=text_rows(rows))
