"""The planner's predicted errors against measured ones on new scenes.

The scenes were used neither for the calibration nor for its margins.
"""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from srbval.bearing import Fault
from srbval.models.ladder import rung_of
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.plan import VACUOUS_PCT, make_plan
from srbval.plan.questions import MEANING, Question, asked_of
from srbval.plan.table import CalibrationScene, CalibrationTable, Entry
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import ContentStore, newest_result
from srbval.studies.calibration_runs import answer_store, drawn, measure_cases
from srbval.studies.harness import Study, StudyResult

SEED = 5  # of the scenes, not that of those between the calibration's
# Tolerances at which each prediction is put to the test.
TOLERANCES_PCT = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)


def held_out() -> list[CalibrationScene]:
    """Random scenes within the grid from another seed; no constant of the planner may be tuned to these."""
    return drawn(SEED, power=2)


@dataclass(frozen=True, kw_only=True)
class PredictionCheck:
    """A rung on a held-out scene: predicted and measured error [%]; `measured_pct` is None where it gave no answer.

    `coverage` is the chance that the prediction states for being a bound.

    `tolerances_pct`: those of `TOLERANCES_PCT` at which the rung was called enough. `chosen_pct`: those at which it was
    the planner's choice.
    """

    JSON_PROPERTIES: ClassVar = ("scene", "within", "within_twice", "broken_pct")

    case: CalibrationScene
    question: Question
    model: str
    predicted_pct: float
    coverage: float
    measured_pct: float | None
    tolerances_pct: tuple[float, ...]
    chosen_pct: tuple[float, ...]

    @property
    def within_twice(self) -> bool:
        """Is the measured error at most twice the predicted one?"""
        return self.measured_pct is not None and self.measured_pct <= 2 * self.predicted_pct

    @property
    def within(self) -> bool:
        """Is the measured error at most the predicted one, which is meant as a bound?"""
        return self.measured_pct is not None and self.measured_pct <= self.predicted_pct

    @property
    def broken_pct(self) -> tuple[float, ...]:
        """Tolerances at which the rung was called enough and was not."""
        return tuple(t for t in self.tolerances_pct if self.measured_pct is None or self.measured_pct > t)

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.case.name


def check_cases(
    cases: Sequence[CalibrationScene],
    calibration: CalibrationTable,
    *,
    jobs: int | None = None,
    store: ContentStore | None = None,
    progress: Progress = silent,
) -> list[PredictionCheck]:
    """Every prediction for every one of `cases`, measured; the reference must have an answer to measure against.

    `jobs`, `store`: see `measure_cases`.
    """
    entries = measure_cases(
        cases, models=calibration.models, seconds=calibration.seconds, jobs=jobs, store=store, progress=progress
    )
    return [check for entry in entries for check in checks_of(entry, calibration)]


def checks_of(entry: Entry, calibration: CalibrationTable) -> Iterable[PredictionCheck]:
    """Every prediction for the scene of a measured entry."""
    for question in asked_of(Fault(entry.case.kind)):
        if entry.reference.get(question) is not None:
            measured = {model: rung.error_pct[question] for model, rung in entry.levels.items()}
            yield from _checks(entry.case, question, measured, calibration)


def checks_again(stored: Iterable[Mapping[str, Any]], calibration: CalibrationTable) -> list[PredictionCheck]:
    """Stored checks with the predictions that the planner makes now, held against the errors measured then."""
    measured: dict[tuple[CalibrationScene, Question], dict[str, float | None]] = {}
    for row in stored:
        key = CalibrationScene(**row["case"]), Question(row["question"])
        measured.setdefault(key, {})[row["model"]] = row["measured_pct"]
    return [check for key, errors in measured.items() for check in _checks(*key, errors, calibration)]


def _checks(
    case: CalibrationScene, question: Question, measured: Mapping[str, float | None], calibration: CalibrationTable
) -> Iterator[PredictionCheck]:
    scene = case.scene("full", seconds=calibration.seconds)
    plans = [
        make_plan(scene, question=question, tolerance_pct=tolerance, calibration=calibration)
        for tolerance in TOLERANCES_PCT
    ]
    for number, candidate in enumerate(plans[0].candidates):
        if candidate.error_pct is None or question.value in rung_of(candidate.model).lacks:
            continue
        yield PredictionCheck(
            case=case,
            question=question,
            model=candidate.model,
            predicted_pct=candidate.error_pct,
            coverage=candidate.coverage or 0.0,
            measured_pct=measured[candidate.model],
            tolerances_pct=tuple(p.tolerance_pct for p in plans if p.candidates[number].ok),
            chosen_pct=tuple(p.tolerance_pct for p in plans if p.met and p.chosen == candidate.model),
        )


@dataclass(frozen=True, kw_only=True)
class Tally:
    """Checks of one question, or of all (`question` None), counted.

    `scenes`: those with a prediction; `scenes_within_twice`: those where every rung's measured error is within twice
    the predicted one. `predictions`: one per scene and rung; `coverage`: the mean chance that they state, `vacuous`:
    those of 100 % and more. `promises`: how often a rung was called enough at a
    tolerance; `broken`: how often it was not.
    """

    question: str | None
    title: str
    scenes: int
    scenes_within_twice: int
    predictions: int
    within: int
    coverage: float
    vacuous: int
    within_twice: int
    unanswered: int
    promises: int
    broken: int


def tallies(checks: Sequence[PredictionCheck]) -> list[Tally]:
    """One row per question, and one for all of them."""
    rows = [_tally(q, [c for c in checks if c.question is q]) for q in Question]
    return [*rows, _tally(None, checks)]


def _tally(question: Question | None, checks: Sequence[PredictionCheck]) -> Tally:
    scenes = {c.case for c in checks}
    missed = {c.case for c in checks if not c.within_twice}
    return Tally(
        question=None if question is None else question.value,
        title="all questions" if question is None else MEANING[question].title,
        scenes=len(scenes),
        scenes_within_twice=len(scenes - missed),
        predictions=len(checks),
        within=sum(c.within for c in checks),
        coverage=float(np.mean([c.coverage for c in checks])) if checks else 0.0,
        vacuous=sum(c.predicted_pct >= VACUOUS_PCT for c in checks),
        within_twice=sum(c.within_twice for c in checks),
        unanswered=sum(c.measured_pct is None for c in checks),
        promises=sum(len(c.tolerances_pct) for c in checks),
        broken=sum(len(c.broken_pct) for c in checks),
    )


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--judge-again", action="store_true", help="predict again, keep the stored measured errors")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    calibration, kept, ran = shipped_calibration(), newest_result("held_out"), dict[str, Any]()
    if options.judge_again and kept is not None:
        checks = checks_again(kept.content["checks"], calibration)
        ran = {"runs_of": kept.content.get("runs_of", kept.origin)}
    else:
        checks = check_cases(held_out(), calibration, jobs=options.jobs, store=answer_store(), progress=progress)
    counted = [to_json(tally) for tally in tallies(checks)]
    content = {"seconds": calibration.seconds, "reference": calibration.reference, "tallies": counted, "checks": checks}
    return StudyResult(name="held_out", content=ran | content, text=text_rows(counted))


STUDY = Study(
    question="Do the planner's predicted errors hold on scenes that it was not calibrated with?",
    minutes=30, run=_run, options=_options,
)  # fmt: skip
