"""Every fidelity level on a scene, compared with the reference model at half its step; the table of that in short."""

import itertools
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import lru_cache
from multiprocessing import get_context
from typing import Any

import numpy as np

from srbval.bearing import Fault, load_bearing
from srbval.models.hierarchy import level_of
from srbval.models.jit import precompile
from srbval.models.precompile import load_kernels
from srbval.models.simulate import run_content
from srbval.plan.plan import refusal
from srbval.plan.questions import MEANING, Answer, Question, answers, asked_of, error_pct
from srbval.plan.table import (
    BASES,
    RADIAL_KN,
    RPM,
    Answered,
    CalibrationScene,
    CalibrationTable,
    Entry,
    LevelEntry,
    read_answers,
)
from srbval.processes.machine import usable_cores
from srbval.progress import Progress, silent
from srbval.recordings import Recording, recording_from_run
from srbval.scene import Scene
from srbval.storage.content_store import ContentStore
from srbval.sweep.pool import attempt

STORE = ContentStore(kind="ladder", computed_by=__name__)
SECONDS = 2.0  # eleven revolutions at the slowest speed
WARM_UP_S = 0.01
BETWEEN_SEED = 1
REFINEMENT = 2  # of the reference's step
LEAST_SHARE = 0.9  # of scenes on which a model must be near, as the planner's bounds hold on nine in ten


def grid(base: str = "paper") -> list[CalibrationScene]:
    """Every calibration scene about a bundled one."""
    own = BASES[base]
    return [
        CalibrationScene(base=base, kind=kind.scene_word, fit=fit, rpm=rpm, radial_kn=load, height_mm=height)
        for kind, fit, rpm, load in itertools.product(own.kinds, own.fits, RPM, RADIAL_KN)
        for height in ((0.0,) if kind is Fault.HEALTHY else own.height_mm)
    ]


def quick_grid(base: str = "paper") -> list[CalibrationScene]:
    """Two scenes, for a quick measurement."""
    height = BASES[base].height_mm[-1]
    return [
        CalibrationScene(base=base, kind=kind.scene_word, fit="play", rpm=710.0, radial_kn=124.8, height_mm=height)
        for kind in (Fault.OUTER, Fault.INNER)
    ]


def between(base: str = "paper") -> list[CalibrationScene]:
    """Random scenes within the grid: they show how much errors vary between its scenes.

    Twice as many with a defect on the inner race, the only ones with sidebands.
    """
    return drawn(BETWEEN_SEED, power=3 if Fault.INNER in BASES[base].kinds else 4, inner=4, base=base)


def drawn(seed: int, *, power: int, inner: int | None = None, base: str = "paper") -> list[CalibrationScene]:
    """For each defect and roller fit 2^`power` points of a scrambled Sobol sequence over speed, load and height.

    2^`inner` with a defect on the inner race.
    """
    from scipy.stats import qmc

    found, own = [], BASES[base]
    low, high = zip(*own.ranges, strict=True)
    for number, (kind, fit) in enumerate(itertools.product(own.kinds, own.fits)):
        sequence = qmc.Sobol(d=len(own.ranges), scramble=True, rng=np.random.default_rng([seed, number]))
        unit = sequence.random_base2(inner or power if kind is Fault.INNER else power)
        for rpm, load, *height in qmc.scale(unit, low, high).tolist():
            height_mm = 0.0 if kind is Fault.HEALTHY else round((height or own.height_mm)[0], 3)
            values = {"rpm": round(rpm), "radial_kn": round(load, 1), "height_mm": height_mm}
            found.append(CalibrationScene(base=base, kind=kind.scene_word, fit=fit, **values))
    return found


def measure_cases(
    cases: Sequence[CalibrationScene],
    *,
    models: Sequence[str],
    seconds: float,
    jobs: int | None = None,
    progress: Progress = silent,
) -> list[Entry]:
    """Every one of `cases` on every model, in `jobs` processes (default: one per usable core).

    Each answer is stored as soon as it is there: an interrupted measurement continues from these.
    """
    task = "measure the model hierarchy"
    scenes = [quick_grid(cases[0].base)[0].scene(model, seconds=WARM_UP_S) for model in models]
    warm_up = tuple(scene for scene in scenes if runs_scene(scene))
    precompile(*warm_up)
    with ProcessPoolExecutor(
        jobs or usable_cores(), mp_context=get_context("spawn"), initializer=_prepare_worker, initargs=(warm_up,)
    ) as pool:
        found = [pool.submit(measure_case, case, models=models, seconds=seconds) for case in cases]
        try:
            for done, future in enumerate(as_completed(found), start=1):
                future.result()
                progress(task, done / len(cases))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [future.result() for future in found]


def runs_scene(scene: Scene) -> bool:
    """Does the scene's model know all that is in it?"""
    return refusal(level_of(scene.model), scene, load_bearing(scene.bearing)) is None


def _prepare_worker(scenes: Sequence[Scene]) -> None:
    """Load the kernels that the scenes need, so that no run's time includes it."""
    load_kernels(scenes)
    for scene in scenes:
        attempt(scene)


def measure_case(case: CalibrationScene, *, models: Sequence[str], seconds: float) -> Entry:
    """One scene on every model."""
    healthy = replace(case, kind=Fault.HEALTHY.scene_word, height_mm=0.0)

    def answered(model: str, finer: int = 1) -> Answered:
        scene, bare = (of.scene(model, seconds=seconds, finer=finer) for of in (case, healthy))
        return answer(scene, healthy=None if scene == bare else bare)

    right = answered(BASES[case.base].reference, REFINEMENT)
    rungs = {model: answered(model) for model in models}
    asked = asked_of(Fault(case.kind))
    return Entry(
        case=case,
        reference={q: right.answers.get(q) for q in asked},
        levels={
            model: LevelEntry(
                status=own.status, wall_per_simulated_s=own.wall_per_simulated_s,
                answers={q: own.answers.get(q) for q in asked},
                error_pct={q: error_pct(q, own.answers.get(q), right.answers.get(q)) for q in asked},
            )
            for model, own in rungs.items()
        },
    )  # fmt: skip


@lru_cache(maxsize=64)
def _healthy(scene: Scene) -> Recording | None:
    tried = attempt(scene)
    return recording_from_run(tried.run) if tried.works and tried.run is not None else None


def answer(scene: Scene, *, healthy: Scene | None = None) -> Answered:
    """Run a scene and read its answers, increments over those of `healthy`, or fetch them where they are stored."""
    stored = STORE.load(run_content(scene), lambda own: Answered(**own | {"answers": read_answers(own["answers"])}))
    if stored is not None:
        return stored
    started, worked = time.perf_counter(), time.process_time()
    tried = attempt(scene)
    share = min((time.process_time() - worked) / (time.perf_counter() - started), 1.0)
    found: dict[Question, Answer | None] = {}
    if tried.works and tried.run is not None:
        found = answers(tried.run, load_bearing(scene.bearing), None if healthy is None else _healthy(healthy))
    fresh = Answered(
        status=tried.status, answers=found,
        wall_per_simulated_s=share * tried.run.wall_s / (tried.run.seconds + scene.settle_s) if tried.run else None,
    )  # fmt: skip
    STORE.save(run_content(scene), fresh)
    return fresh


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
    from scipy.stats import binomtest  # takes a while to load, and the processes of the runs need none

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
