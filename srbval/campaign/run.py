"""Run a campaign: plan, skip what has a result, hand the rest to an engine, note what comes back."""

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from srbval.campaign.case import CampaignCase, CaseResult, CaseTask, Ending, write_result
from srbval.campaign.engines.local import Engine, Job
from srbval.campaign.folder import CampaignFolder, folder_lock
from srbval.campaign.planning import final_scene, plan_cases, scene_of
from srbval.campaign.settings import Campaign
from srbval.campaign.status import failures, write_table
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress, silent

ALMOST_DONE = 0.999  # largest share reported while cases run: rounding must not report the task as done
MESSAGES = 10  # about failed cases while the campaign runs; all of them are in its summary
GIVE_UP_AFTER = 3  # results in a row that could not be written: the disk is full or gone


@dataclass(frozen=True, kw_only=True)
class CampaignSummary:
    """How a campaign ended. `ran` of the `cases` were run this time; `failed`: index, key, ending, reason of each.

    `damaged` results were there before, not as they were written, and run again.
    `simulation_s` is the sum over the simulations of this time.
    """

    name: str
    engine: str
    workers: int
    cases: int
    done: int
    ran: int
    failed: tuple[dict[str, Any], ...]
    damaged: int
    wall_s: float
    simulation_s: float
    table: Path


def run_campaign(
    campaign: Campaign,
    path: Path,
    *,
    engine: Engine,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> CampaignSummary:
    """Run what has no result yet, longest first, and write the results table in the folder `path`.

    A case that fails has a result that says why; one whose process died, or whose result could not be written, is
    tried again the next time. `progress` counts the expected cost of the cases of this time; `message` gets a line
    about each of the first cases that fail.

    Raises `ConfigurationError` for a folder in use or another campaign's, `DataError` for one that cannot be written
    or a disk that is full.
    """
    started = time.perf_counter()
    cases = plan_cases(campaign)
    folder = CampaignFolder(path.resolve())
    with folder_lock(folder.path) as killed:
        if killed:
            message(f"an earlier run of this campaign was killed{killed}; its results are used")
        for found in folder.write_plan(campaign.name, campaign.title, cases):
            message(f"{found.file.name} was damaged; its results are kept and it is written again")
        results, damaged = folder.read_results(case.key for case in cases)
        if damaged:
            first = next(iter(damaged.values()))
            message(f"damaged results, removed and run again: {len(damaged)}; the first: {first.file}: {first.why}")
        again = [key for key, result in results.items() if not result.ending.final]
        folder.remove_results([*damaged, *again])
        results = {key: result for key, result in results.items() if result.ending.final}
        missing = {case.key: case for case in cases if case.key not in results}
        results |= {key: _refuse(folder, campaign, case) for key, case in missing.items() if case.refused is not None}
        pending = sorted((c for c in missing.values() if c.refused is None), key=lambda case: -case.planned_s)
        ran = _run_pending(folder, campaign, pending, engine, progress, message) if pending else {}
        results |= folder.read_results(ran)[0]
        return CampaignSummary(
            name=campaign.name,
            engine=engine.name,
            workers=engine.workers,
            cases=len(cases),
            done=sum(case.key in results for case in cases),
            ran=len(ran),
            failed=tuple(failures(cases, results, [*folder.journal().ended, *ran.values()])),
            damaged=len(damaged),
            wall_s=time.perf_counter() - started,
            simulation_s=sum(result.simulation_s for result in ran.values()),
            table=write_table(folder, cases, results),
        )


def _run_pending(
    folder: CampaignFolder,
    campaign: Campaign,
    pending: Sequence[CampaignCase],
    engine: Engine,
    progress: Progress,
    message: Callable[[str], None],
) -> dict[str, CaseResult]:
    """Run `pending` and note results as they come; stop where nothing can be written any more."""
    needed, free = sum(case.expected_bytes for case in pending), shutil.disk_usage(folder.path).free
    if needed > free:
        raise DataError(
            f"{folder.path}: {len(pending)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. "
            "Free some space, choose another -o, or ask for fewer outputs."
        )
    task, total_s = f"campaign {campaign.name}, {len(pending)} cases", sum(case.planned_s for case in pending)
    cases, ran = {case.key: case for case in pending}, dict[str, CaseResult]()
    ended_s, failed, unwritten = 0.0, 0, 0
    progress(task, 0.0)
    job = Job(
        folder=folder.path,
        # one scene per model and solver, whose kernels are compiled before any case runs
        precompiled=[final_scene(campaign, case) for case in {(c.model, c.solver): c for c in pending}.values()],
        tasks=(
            CaseTask(
                key=case.key,
                scene=final_scene(campaign, case),
                outputs=campaign.outputs,
                path=folder.result_path(case.key),
                limit_s=campaign.limit_s(case.planned_s),
            )
            for case in pending
        ),
        count=len(pending),
    )
    running = engine.run(job)
    try:
        for result in running:
            path = folder.result_path(result.key)
            if result.ending in (Ending.CRASHED, Ending.TIMED_OUT) and not path.exists():
                try:
                    write_result(path, result, None)
                except DataError:
                    result = replace(result, ending=Ending.UNWRITTEN)
            folder.note_end(result)
            ran[result.key] = result
            ended_s += cases[result.key].planned_s
            if not result.ending.usable and (failed := failed + 1) <= MESSAGES:
                message(f"case {cases[result.key].index} {result.ending.value}: {result.reason}")
            progress(task, 1.0 if len(ran) == len(pending) else min(ended_s / total_s, ALMOST_DONE))
            unwritten = unwritten + 1 if result.ending is Ending.UNWRITTEN else 0
            if unwritten == GIVE_UP_AFTER:
                raise DataError(
                    f"{folder.path}: {GIVE_UP_AFTER} results in a row could not be written ({result.reason}). "
                    f"{sum(one.ending.final for one in ran.values())} of {len(pending)} cases of this run are safe, "
                    "nothing half-written was left behind. Free some space and give the same command again: the rest "
                    "will be run."
                )
    finally:
        running.close()
        folder.remove_incomplete()  # of processes that were ended while they wrote
    return ran


def _refuse(folder: CampaignFolder, campaign: Campaign, case: CampaignCase) -> CaseResult:
    """Write the result of a case of which no scene could be made."""
    result = CaseResult(key=case.key, ending=Ending.REFUSED, reason=case.refused or "")
    try:
        scene = scene_of(campaign, case.point)
    except SrbvalError:
        scene = None
    write_result(folder.result_path(case.key), result, scene)
    folder.note_end(result)
    return result
