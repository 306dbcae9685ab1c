"""Run a campaign: plan, skip what has a result, hand the rest to an engine, note what comes back."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from srbval.campaign.campaign_folder import CampaignFolder
from srbval.campaign.case import FINAL, RETRIED, CampaignCase, CaseOutcome, CaseTask, Ending
from srbval.campaign.case_file import write_failure
from srbval.campaign.engines.engine import Engine, Job
from srbval.campaign.lock import folder_lock
from srbval.campaign.planning import final_scene, plan_cases, scene_of
from srbval.campaign.results import Results
from srbval.campaign.settings import Campaign
from srbval.campaign.status import failures, write_table
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress, silent
from srbval.scene import Scene

ALMOST_DONE = 0.999  # largest share reported while cases run: rounding must not report the task as done
MESSAGES = 10  # about failed cases while the campaign runs; all of them are in its summary
GIVE_UP_AFTER = 3  # results in a row that could not be written: the disk is full or gone


@dataclass(frozen=True, kw_only=True)
class CampaignSummary:
    """How a campaign ended. `ran` of the `cases` were run this time; `failed`: index, key, ending, reason of each.

    `damaged` results were there before, not as they were written, and run again.
    `simulation_s` is the sum over the simulations of this time, `case_s` over the whole cases, writing included.
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
    case_s: float
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
        for found in folder.write_plan(campaign, cases):
            message(f"{found.file.name} was damaged; its results are kept and it is written again")
        results = Results(folder, (case.key for case in cases))
        damaged = len(results.damaged)
        if damaged:
            first = next(iter(results.damaged.values()))
            message(
                f"damaged results, removed and run again: {len(results.damaged)}; the first: {first.file}: {first.why}"
            )
        damaged = len(results.damaged)
        results.remove([*results.damaged, *(r.key for r in results.intact.values() if r.ending in RETRIED)])
        _write_refused(folder, campaign, cases, results)
        pending = _pending(cases, results)
        _check_space(folder, pending)
        job = Job(
            folder=folder.path,
            precompiled=_one_of_each_model(campaign, pending),
            tasks=_tasks(folder, campaign, pending),
            count=len(pending),
        )
        tracker = _Tracker(campaign.name, pending, progress, message)
        outcomes = _follow(folder, engine, job, tracker) if pending else {}
        results.read(outcomes)
        return CampaignSummary(
            name=campaign.name,
            engine=engine.name,
            workers=engine.workers,
            cases=len(cases),
            done=sum(case.key in results.intact for case in cases),
            ran=len(outcomes),
            failed=tuple(failures(cases, results, [*folder.journal(), *outcomes.values()])),
            damaged=damaged,
            wall_s=time.perf_counter() - started,
            simulation_s=sum(o.simulation_s for o in outcomes.values()),
            case_s=sum(o.wall_s for o in outcomes.values()),
            table=write_table(folder, cases, results),
        )


def _follow(folder: CampaignFolder, engine: Engine, job: Job, tracker: _Tracker) -> dict[str, CaseOutcome]:
    """Note outcomes as they come; stop where nothing can be written any more."""
    outcomes: dict[str, CaseOutcome] = {}
    unwritten = 0
    running = engine.run(job)
    try:
        for outcome in running:
            if outcome.ending in RETRIED and not folder.result_path(outcome.key).exists():
                outcome = _write_crash(folder, outcome)
            folder.note_end(outcome)
            outcomes[outcome.key] = outcome
            tracker.ended(outcome)
            unwritten = unwritten + 1 if outcome.ending is Ending.UNWRITTEN else 0
            if unwritten == GIVE_UP_AFTER:
                done = sum(o.ending in FINAL for o in outcomes.values())
                raise DataError(
                    f"{folder.path}: {GIVE_UP_AFTER} results in a row could not be written ({outcome.reason}). "
                    f"{done} of {job.count} cases of this run are safe, nothing half-written was left behind. "
                    "Free some space and give the same command again: the rest will be run."
                )
    finally:
        running.close()
        folder.remove_incomplete()  # of processes that were ended while they wrote
    return outcomes


class _Tracker:
    """Reports the share of the expected cost that is done, and failures as they come."""

    def __init__(
        self, name: str, pending: Sequence[CampaignCase], progress: Progress, message: Callable[[str], None]
    ) -> None:
        self._pending = {case.key: case for case in pending}
        self._progress, self._message = progress, message
        self._task = f"campaign {name}, {len(pending)} cases"
        self._total_s = sum(case.planned_s for case in pending)
        self._ended_s = 0.0
        self._ended = self._failed = 0
        if pending:
            progress(self._task, 0.0)

    def ended(self, outcome: CaseOutcome) -> None:
        """One more case has ended."""
        case = self._pending[outcome.key]
        self._ended += 1
        self._ended_s += case.planned_s
        if not outcome.ending.usable and self._failed < MESSAGES:
            self._failed += 1
            self._message(f"case {case.index} {outcome.ending.value}: {outcome.reason}")
        last = self._ended == len(self._pending)
        self._progress(self._task, 1.0 if last else min(self._ended_s / self._total_s, ALMOST_DONE))


def _pending(cases: Sequence[CampaignCase], results: Results) -> list[CampaignCase]:
    """The cases without a result, the longest first; of cases with the same content one."""
    pending = {case.key: case for case in cases if case.key not in results.intact}
    return sorted(pending.values(), key=lambda case: -case.planned_s)


def _tasks(folder: CampaignFolder, campaign: Campaign, cases: Sequence[CampaignCase]) -> Iterator[CaseTask]:
    for case in cases:
        yield CaseTask(
            key=case.key,
            scene=final_scene(campaign, case),
            outputs=campaign.outputs,
            path=folder.result_path(case.key),
            limit_s=campaign.limit_s(case.planned_s),
        )


def _one_of_each_model(campaign: Campaign, cases: Sequence[CampaignCase]) -> list[Scene]:
    """One scene per model and solver, whose kernels are compiled before any case runs."""
    return [final_scene(campaign, case) for case in {(c.model, c.solver): c for c in cases}.values()]


def _write_refused(folder: CampaignFolder, campaign: Campaign, cases: Sequence[CampaignCase], results: Results) -> None:
    for case in cases:
        if case.refused is not None and case.key not in results.intact:
            try:
                scene = scene_of(campaign, case.point)
            except SrbvalError:
                scene = None
            path = folder.result_path(case.key)
            try:
                write_failure(path, scene, Ending.REFUSED, case.refused)
            except OSError as error:
                raise DataError(f"{path}: cannot be written ({error.strerror}). Free some space.") from None
            folder.note_end(CaseOutcome(key=case.key, ending=Ending.REFUSED, reason=case.refused))
            results.read([case.key])


def _write_crash(folder: CampaignFolder, outcome: CaseOutcome) -> CaseOutcome:
    try:
        write_failure(folder.result_path(outcome.key), None, outcome.ending, outcome.reason)
    except (OSError, DataError):
        return replace(outcome, ending=Ending.UNWRITTEN)
    return outcome


def _check_space(folder: CampaignFolder, pending: Sequence[CampaignCase]) -> None:
    needed, free = sum(case.expected_bytes for case in pending), shutil.disk_usage(folder.path).free
    if needed > free:
        raise DataError(
            f"{folder.path}: {len(pending)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. "
            "Free some space, choose another -o, or ask for fewer outputs."
        )
