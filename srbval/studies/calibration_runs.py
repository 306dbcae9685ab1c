"""Every fidelity level on a scene, compared with the reference model at half its step."""

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import lru_cache
from multiprocessing import get_context
from typing import Any

from srbval.bearing import Fault, load_bearing
from srbval.models.kernel_cache import precompile
from srbval.models.precompile import load_kernels
from srbval.models.run_file import scene_content
from srbval.plan.cases import BASES, CalibrationScene, quick_grid
from srbval.plan.questions import Answer, Question, answers, asked_of, error_pct
from srbval.plan.table import Answered, Entry, RungEntry, read_answers
from srbval.plan.timing import attempt
from srbval.processes.machine import usable_cores
from srbval.progress import Progress, silent
from srbval.recordings import Recording, recording_from_run
from srbval.scene import Scene
from srbval.storage.stored_result import ContentStore

SECONDS = 2.0  # eleven revolutions at the slowest speed

WARM_UP_S = 0.01

REFINEMENT = 2  # of the reference's step


def answer_store() -> ContentStore:
    """Where answers are stored: the user's cache."""
    return ContentStore(kind="ladder", computed_by=__name__)


def measure_cases(
    cases: Sequence[CalibrationScene],
    *,
    models: Sequence[str],
    seconds: float,
    jobs: int | None = None,
    store: ContentStore | None = None,
    progress: Progress = silent,
) -> list[Entry]:
    """Every one of `cases` on every rung, in `jobs` processes (default: one per usable core).

    With a `store`, each answer is stored as soon as it is there: an interrupted measurement continues from these.
    """
    task = "measure the ladder"
    for model in models:
        precompile(model)
    with ProcessPoolExecutor(
        jobs or usable_cores(), mp_context=get_context("spawn"), initializer=_prepare_worker, initargs=(tuple(models),)
    ) as pool:
        found = [pool.submit(measure_case, case, models=models, seconds=seconds, store=store) for case in cases]
        try:
            for done, future in enumerate(as_completed(found), start=1):
                future.result()
                progress(task, done / len(cases))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [future.result() for future in found]


def _prepare_worker(models: Sequence[str]) -> None:
    """Load the kernels that the rungs need, so that no run's time includes it."""
    load_kernels(models)
    for model in models:
        attempt(quick_grid()[0].scene(model, seconds=WARM_UP_S))


def measure_case(
    case: CalibrationScene, *, models: Sequence[str], seconds: float, store: ContentStore | None = None
) -> Entry:
    """One scene on every rung."""
    healthy = replace(case, kind=Fault.HEALTHY.scene_word, height_mm=0.0)

    def answered(model: str, finer: int = 1) -> Answered:
        scene, bare = (of.scene(model, seconds=seconds, finer=finer) for of in (case, healthy))
        return answer(scene, store, healthy=None if scene == bare else bare)

    right = answered(BASES[case.base].reference, REFINEMENT)
    rungs = {model: answered(model) for model in models}
    asked = asked_of(Fault(case.kind))
    return Entry(
        case=case,
        reference={q: right.answers.get(q) for q in asked},
        rungs={
            model: RungEntry(
                status=own.status, wall_per_simulated_s=own.wall_per_simulated_s,
                answers={q: own.answers.get(q) for q in asked},
                error_pct={q: error_pct(q, own.answers.get(q), right.answers.get(q)) for q in asked},
            )
            for model, own in rungs.items()
        },
    )  # fmt: skip


def _answered(stored: dict[str, Any]) -> Answered:
    return Answered(**stored | {"answers": read_answers(stored["answers"])})


@lru_cache(maxsize=64)
def _healthy(scene: Scene) -> Recording | None:
    tried = attempt(scene)
    return recording_from_run(tried.run) if tried.ok and tried.run is not None else None


def answer(scene: Scene, store: ContentStore | None = None, *, healthy: Scene | None = None) -> Answered:
    """Run a scene and read its answers, increments over those of `healthy`, or fetch them from `store`."""
    stored = None if store is None else store.load(scene_content(scene), _answered)
    if stored is not None:
        return stored
    started, worked = time.perf_counter(), time.process_time()
    tried = attempt(scene)
    share = min((time.process_time() - worked) / (time.perf_counter() - started), 1.0)
    found: dict[Question, Answer | None] = {}
    if tried.ok and tried.run is not None:
        found = answers(tried.run, load_bearing(scene.bearing), None if healthy is None else _healthy(healthy))
    fresh = Answered(
        status=tried.status, answers=found,
        wall_per_simulated_s=share * tried.run.wall_s / (tried.run.seconds + scene.settle_s) if tried.run else None,
    )  # fmt: skip
    if store is not None:
        store.save(scene_content(scene), fresh)
    return fresh
