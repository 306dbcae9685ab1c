"""Run a campaign: write its table of cases, skip every case that has a result, hand the others to an engine."""

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.campaign.cases import CampaignCase, final_scene, plan_cases
from srbval.campaign.engines import Engine, choose_engine
from srbval.campaign.folder import (
    counted,
    folder_lock,
    read_results,
    remove_incomplete,
    result_path,
    write_cases,
    write_results,
)
from srbval.campaign.local import Job
from srbval.campaign.results import CaseResult, CaseTask, Ending, write_result
from srbval.campaign.settings import Campaign
from srbval.errors import DataError
from srbval.progress import Progress, silent

ALMOST_DONE = 0.999  # largest share reported while cases run: rounding must not report the task as done
MESSAGES = 10  # about failed cases while the campaign runs; all of them are in its summary
GIVE_UP_AFTER = 3  # results in a row that could not be written: the disk is full or gone


def run_campaign(
    campaign: Campaign,
    path: Path,
    *,
    engine: Engine | None = None,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run all cases that have no result yet, longest first, and write the results table in the folder `path`.

    A failed case has a result with the reason; a case whose process died, or whose result could not be written, is
    tried again the next time. `engine` is `choose_engine()` by default. `progress` counts the expected cost of the
    cases of this time; `message` gets a line about each of the first cases that fail.

    Returns the document of ``campaign run``: `ran` of the `cases` were run this time, `damaged` results were run again,
    `failed` lists the cases without a good result, `simulation_s` sums over the cases of this time.
    Raises `ConfigurationError` for a folder that is in use or belongs to another campaign, `DataError` for a folder
    that cannot be written or a disk that is full.
    """
    started = time.perf_counter()
    engine = engine or choose_engine()
    cases = plan_cases(campaign)
    folder = path.resolve()
    with folder_lock(folder):
        write_cases(folder, campaign, cases)
        remove_incomplete(folder)
        results, damaged = read_results(folder, (case.key for case in cases))
        if damaged:
            first = damaged[0]
            said = f"{first['file']}: {first['why']}"
            message(f"damaged results, which are run again: {len(damaged)}; the first: {said}")
        results = {key: result for key, result in results.items() if result.ending.final}
        missing = {case.key: case for case in cases if case.key not in results}
        for key, case in missing.items():
            if case.refused is not None:
                results[key] = CaseResult(key=key, ending=Ending.REFUSED, reason=case.refused)
                write_result(result_path(folder, key), results[key], None)
        pending = sorted((c for c in missing.values() if c.refused is None), key=lambda case: -case.planned_s)
        ran = _run_pending(folder, campaign, pending, engine, progress, message) if pending else {}
        results |= read_results(folder, ran)[0]
        return {
            **counted(campaign, cases, results, ran),
            "engine": engine.name,
            "workers": engine.workers,
            "ran": len(ran),
            "damaged": len(damaged),
            "wall_s": time.perf_counter() - started,
            "simulation_s": sum(result.simulation_s for result in ran.values()),
            "table": write_results(folder, cases, results),
        }


def _run_pending(
    folder: Path,
    campaign: Campaign,
    pending: Sequence[CampaignCase],
    engine: Engine,
    progress: Progress,
    message: Callable[[str], None],
) -> dict[str, CaseResult]:
    """Run `pending` and return the results; stop as soon as nothing can be written any more."""
    needed, free = sum(case.expected_bytes for case in pending), shutil.disk_usage(folder).free
    if needed > free:
        raise DataError(
            f"{folder}: {len(pending)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. "
            "Free some space, choose another -o, or ask for fewer outputs."
        )
    task, total_s = f"campaign {campaign.name}, {len(pending)} cases", sum(case.planned_s for case in pending)
    cases, ran = {case.key: case for case in pending}, dict[str, CaseResult]()
    ended_s, failed, unwritten = 0.0, 0, 0
    progress(task, 0.0)
    first = {(case.model, case.solver): case for case in pending}.values()  # for which kernels are compiled
    tasks = (
        CaseTask(
            key=case.key,
            scene=final_scene(campaign, case),
            outputs=campaign.outputs,
            path=result_path(folder, case.key),
            limit_s=campaign.limit_s(case.planned_s),
        )
        for case in pending
    )
    precompiled = [final_scene(campaign, case) for case in first]
    running = engine.run(Job(folder=folder, precompiled=precompiled, tasks=tasks, count=len(pending)))
    try:
        for result in running:
            file = result_path(folder, result.key)
            if result.ending in (Ending.CRASHED, Ending.TIMED_OUT):
                try:
                    write_result(file, result, None)
                except DataError:
                    result = replace(result, ending=Ending.UNWRITTEN)
            ran[result.key] = result
            ended_s += cases[result.key].planned_s
            if not result.ending.usable and (failed := failed + 1) <= MESSAGES:
                message(f"case {cases[result.key].index} {result.ending.value}: {result.reason}")
            progress(task, 1.0 if len(ran) == len(pending) else min(ended_s / total_s, ALMOST_DONE))
            unwritten = unwritten + 1 if result.ending is Ending.UNWRITTEN else 0
            if unwritten == GIVE_UP_AFTER:
                raise DataError(
                    f"{folder}: {GIVE_UP_AFTER} results in a row could not be written ({result.reason}). "
                    f"{sum(one.ending.final for one in ran.values())} of {len(pending)} cases of this run are safe, "
                    "nothing half-written was left behind. Free some space and give the same command again: the rest "
                    "will be run."
                )
    finally:
        running.close()
        remove_incomplete(folder)  # of processes that were ended while they wrote
    return ran
