"""Run a campaign: plan, leave out what is there, hand the rest to an engine, put down what comes back."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from srbval.campaign.case import Case
from srbval.campaign.case_file import write_failure
from srbval.campaign.engines.engine import Engine, Job
from srbval.campaign.lock import folder_lock
from srbval.campaign.planning import final_scene, plan_cases, scene_of
from srbval.campaign.results_table import write_table
from srbval.campaign.settings import Campaign
from srbval.campaign.status import failures
from srbval.campaign.store import Store, unfinished
from srbval.campaign.task import FINAL, LOST, Ending, Outcome, Task
from srbval.errors import DataError, SrbvalError
from srbval.scene import Scene

GIVE_UP_AFTER = 3  # results in a row that could not be written: the disk is full or gone


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a campaign is; `remaining_s` None until there is something to judge it by."""

    cases: int
    done: int
    failed: int
    remaining_s: float | None


@dataclass(frozen=True, kw_only=True)
class Finished:
    """How a campaign ended. `ran` of the `cases` were run this time; `failed`: index, key, ending, reason of each.

    `simulation_s` and `case_s`: what the simulations, and the cases with all that is about them, took in sum.
    """

    name: str
    engine: str
    workers: int
    cases: int
    done: int
    ran: int
    failed: tuple[dict[str, Any], ...]
    wall_s: float
    simulation_s: float
    case_s: float
    table: Path

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def run_campaign(
    campaign: Campaign,
    folder: Path,
    *,
    engine: Engine,
    progress: Callable[[Progress], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> Finished:
    """Run what has no result yet, longest first, and write the results table.

    A case that fails has a result that says why; one whose process died, or whose result could not be written, is
    tried again the next time. Raises `ConfigurationError` for a folder in use or another campaign's, `DataError` for
    one that cannot be written or a disk that is full.
    """
    started = time.perf_counter()
    cases = plan_cases(campaign)
    store = Store(folder.resolve())
    with folder_lock(store.folder) as left:
        if left:
            say(f"an earlier run of this campaign was cut off{left}; its results are kept")
        suspects = unfinished(store.journal())
        store.open(campaign, cases)
        _forget_crashed(store)
        _put_refused(store, campaign, cases)
        present = store.present()
        pending = {case.key: case for case in cases if case.key not in present}
        _check_space(store, list(pending.values()))
        ordered = sorted(pending.values(), key=lambda case: -case.planned_s)
        count = _Count(cases, pending, progress)
        job = Job(
            folder=store.folder,
            first=_first(campaign, ordered),
            tasks=_Tasks(store, campaign, ordered),
            begun=store.begun,
            suspects=frozenset(suspects) & set(pending),
        )
        outcomes = _follow(store, engine, job, count)
        table, landed = write_table(store), store.present()
        failed = failures(store, cases, outcomes)
        return Finished(
            name=campaign.name,
            engine=engine.name,
            workers=engine.workers,
            cases=len(cases),
            done=sum(case.key in landed for case in cases),
            ran=len(outcomes),
            failed=tuple(failed),
            wall_s=time.perf_counter() - started,
            simulation_s=sum(o.simulation_s for o in outcomes.values()),
            case_s=sum(o.wall_s for o in outcomes.values()),
            table=table,
        )


def _follow(store: Store, engine: Engine, job: Job, count: _Count) -> dict[str, Outcome]:
    """Note outcomes as they come; stop where nothing can be written any more."""
    outcomes: dict[str, Outcome] = {}
    unwritten = 0
    if not len(job.tasks):
        return outcomes
    running = engine.run(job)
    try:
        for outcome in running:
            if outcome.ending in LOST and not store.path_of(outcome.key).exists():
                outcome = _keep_crash(store, outcome)
            store.ended(outcome)
            outcomes[outcome.key] = outcome
            count.add(outcome)
            unwritten = unwritten + 1 if outcome.ending is Ending.UNWRITTEN else 0
            if unwritten == GIVE_UP_AFTER:
                done = sum(o.ending in FINAL for o in outcomes.values())
                raise DataError(
                    f"{store.folder}: {GIVE_UP_AFTER} results in a row could not be written ({outcome.reason}). "
                    f"{done} of {len(job.tasks)} cases of this run are safe, nothing half-written was left behind. "
                    "Free some space and give the same command again: the rest will be run."
                )
    finally:
        close = getattr(running, "close", None)
        if close is not None:
            close()
        store.clear_parts()  # of processes that were ended while they wrote
    return outcomes


class _Count:
    """Counts what is done and estimates what remains from the cost of what is."""

    def __init__(self, cases: Sequence[Case], pending: dict[str, Case], progress: Callable[[Progress], None]) -> None:
        self._cases, self._pending, self._progress = len(cases), pending, progress
        self._done = self._cases - len(pending)
        self._failed = sum(case.refused is not None for case in cases)
        self._left = sum(case.planned_s for case in pending.values())
        self._ended = 0.0
        self._started = time.perf_counter()
        progress(Progress(cases=self._cases, done=self._done, failed=self._failed, remaining_s=None))

    def add(self, outcome: Outcome) -> None:
        """One more has ended."""
        planned_s = self._pending[outcome.key].planned_s
        self._left -= planned_s
        self._ended += planned_s
        self._done += outcome.ending is not Ending.UNWRITTEN
        self._failed += outcome.ending is not Ending.OK
        elapsed = time.perf_counter() - self._started
        remaining = elapsed * max(self._left, 0.0) / self._ended if self._ended else None
        self._progress(Progress(cases=self._cases, done=self._done, failed=self._failed, remaining_s=remaining))


class _Tasks:
    """The tasks of cases, each made when it is asked for."""

    def __init__(self, store: Store, campaign: Campaign, cases: Sequence[Case]) -> None:
        self._store, self._campaign, self._cases = store, campaign, cases

    def __len__(self) -> int:
        return len(self._cases)

    def __iter__(self) -> Iterator[Task]:
        for case in self._cases:
            yield Task(
                key=case.key,
                scene=final_scene(self._campaign, case),
                outputs=self._campaign.outputs,
                path=self._store.path_of(case.key),
                limit_s=self._campaign.limit_s(case.planned_s),
            )


def _first(campaign: Campaign, cases: Sequence[Case]) -> list[Scene]:
    """One scene of each model and solver, whose kernels are compiled before any case runs."""
    return [final_scene(campaign, case) for case in {(c.model, c.solver): c for c in cases}.values()]


def _forget_crashed(store: Store) -> None:
    """Remove what says that a process died or was ended: such a case is tried again."""
    endings = {entry["key"]: entry.get("ending") for entry in store.journal() if entry["event"] == "ended"}
    for key, ending in endings.items():
        if ending in LOST:
            store.path_of(key).unlink(missing_ok=True)


def _put_refused(store: Store, campaign: Campaign, cases: Sequence[Case]) -> None:
    for case in cases:
        path = store.path_of(case.key)
        if case.refused is not None and not path.exists():
            try:
                scene = scene_of(campaign, case.point)
            except SrbvalError:
                scene = None
            write_failure(path, scene, Ending.REFUSED, case.refused)
            store.ended(Outcome(key=case.key, ending=Ending.REFUSED, reason=case.refused))


def _keep_crash(store: Store, outcome: Outcome) -> Outcome:
    try:
        write_failure(store.path_of(outcome.key), None, outcome.ending, outcome.reason)
    except (OSError, DataError):
        return replace(outcome, ending=Ending.UNWRITTEN)
    return outcome


def _check_space(store: Store, pending: Sequence[Case]) -> None:
    needed, free = sum(case.expected_bytes for case in pending), shutil.disk_usage(store.folder).free
    if needed > free:
        raise DataError(
            f"{store.folder}: {len(pending)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. "
            "Free some space, choose another -o, or ask for fewer outputs."
        )
