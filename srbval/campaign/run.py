"""Run a campaign: write its table of cases, skip every case that has a result, hand the others to an engine."""

import contextlib
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.campaign.cases import CampaignCase, plan_cases, scene_of
from srbval.campaign.engines import Engine, choose_engine
from srbval.campaign.folder import (
    CampaignTable,
    counted,
    folder_lock,
    read_results,
    remove_incomplete,
    result_path,
    write_results,
    write_table,
)
from srbval.campaign.results import CaseResult, CaseTask, version
from srbval.campaign.settings import Campaign
from srbval.errors import DataError
from srbval.progress import Progress, silent

ALMOST_DONE = 0.999  # largest share reported while cases run: rounding must not report the task as done
MESSAGES = 10  # about failed cases while the campaign runs; all of them are in its summary


def run_campaign(
    campaign: Campaign,
    path: str | Path,
    *,
    engine: Engine | None = None,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run all cases that have no result yet, longest first, and write the results table in the folder `path`.

    A failed case has a result with the reason; a case whose process died is tried again the next time. `engine` is
    `choose_engine()` by default. `progress` counts the expected cost of the cases of this time; `message` gets a line
    about each of the first cases that fail.

    Returns the document of ``campaign run``: `ran` of the `cases` were run this time, `failed` lists the cases without
    a good result. Raises `ConfigurationError` for a folder that is in use or contains another campaign, `DataError` for
    a folder that cannot be written or a disk that is full.
    """
    started, engine, folder = time.perf_counter(), engine or choose_engine(), Path(path).resolve()
    table = CampaignTable(campaign=campaign, version=version(), cases=tuple(plan_cases(campaign)))
    with folder_lock(folder):
        write_table(folder, table)
        results = {key: result for key, result in read_results(folder, table).items() if result.final}
        missing = {case.key: case for case in table.cases if case.key not in results}
        ran = _run_missing(folder, table, missing, engine, progress, message) if missing else {}
        return counted(table, results | ran) | {
            "engine": engine.name,
            "ran": len(ran),
            "wall_s": time.perf_counter() - started,
            "table": write_results(folder, table, results | ran),
        }


def _run_missing(
    folder: Path,
    table: CampaignTable,
    missing: Mapping[str, CampaignCase],
    engine: Engine,
    progress: Progress,
    message: Callable[[str], None],
) -> dict[str, CaseResult]:
    """Run the `missing` cases, the longest first, and return their results."""
    longest_first = sorted(missing.values(), key=lambda case: -case.planned_s)
    needed, free = sum(case.expected_bytes for case in longest_first), shutil.disk_usage(folder).free
    if needed > free:
        raise DataError(
            f"{folder}: {len(missing)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. Free "
            "some space, choose another -o, or ask for fewer outputs."
        )
    name, total_s = f"campaign {table.campaign.name}, {len(missing)} cases", sum(c.planned_s for c in longest_first)
    ran, ended_s, failed = dict[str, CaseResult](), 0.0, 0
    progress(name, 0.0)
    try:
        with contextlib.closing(engine.run(_task(folder, table, case) for case in longest_first)) as results:
            for result in results:
                case, ran[result.key] = missing[result.key], result
                ended_s += case.planned_s
                progress(name, 1.0 if len(ran) == len(missing) else min(ended_s / total_s, ALMOST_DONE))
                if not result.usable and (failed := failed + 1) <= MESSAGES:
                    message(f"case {case.index} {result.status}: {result.reason}")
    except DataError as error:
        kept = f"{len(ran)} of {len(missing)} cases of this run are done and kept; the same command runs the rest."
        raise DataError(f"{error} {kept}") from None
    finally:
        remove_incomplete(folder)  # of processes that were ended while they wrote
    return ran


def _task(folder: Path, table: CampaignTable, case: CampaignCase) -> CaseTask:
    return CaseTask(
        key=case.key,
        version=table.version,
        scene=replace(scene_of(table.campaign, case.point), model=case.model),
        outputs=table.campaign.outputs,
        path=result_path(folder, case.key),
        limit_s=table.campaign.limit_s(case.planned_s),
    )
