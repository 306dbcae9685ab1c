"""Overhead of a campaign of very many cases besides the simulations: measured with tiny cases, extrapolated."""

import tempfile
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from srbval.campaign.engines import NAMES, choose_engine
from srbval.campaign.engines.local import Engine
from srbval.campaign.folder import PLAN
from srbval.campaign.planning import plan_cases
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import Campaign
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.tables import build
from srbval.studies.harness import Study, StudyResult
from srbval.studies.machine import peak_bytes

CASE_S = 5.0  # assumed wall time of a real case on one core: 10 s of the full model
EXTRAPOLATED = ((10_000, 64), (1_000_000, 2000))  # cases and workers, on clusters that fit them


def extrapolate(found: Mapping[str, Any], cases: int, workers: int) -> dict[str, Any]:
    """The overhead of `cases` real ones of `CASE_S` on `workers`, each part in proportion to the cases."""
    share, per_case_s, base = cases / found["cases"], found["coordinator_s"], found["base_bytes"]
    peak = None if found["peak_bytes"] is None or base is None else base + (found["peak_bytes"] - base) * share
    return {
        "cases": cases, "workers": workers, "planning_s": found["planning_s"] * share,
        "simulation_s": cases * CASE_S / workers, "coordinator_s": per_case_s * cases,
        "coordinator_share": per_case_s * workers / CASE_S,
        "workers_before_the_coordinator_is_full": int(CASE_S / per_case_s), "peak_bytes": peak, "files": cases,
        "files_a_folder": cases / 256, "result_bytes": found["file_bytes"] * cases,
        "plan_and_journal_bytes": found["plan_and_journal_bytes"] * share,
    }  # fmt: skip


def measure_scale(cases: int, engine: Engine, *, progress: Progress = silent) -> dict[str, Any]:
    """Run `cases` tiny cases of the cheapest model in a temporary folder.

    `run_s` of the whole run, planning included; `coordinator_s` is this process's CPU time per case; `peak_bytes` its
    peak memory and `base_bytes` that before the campaign, None where the system does not tell; `file_bytes` is the size
    of a result without signals.
    """
    campaign, base_bytes, started = tiny(cases), peak_bytes(), time.perf_counter()
    plan_cases(campaign)
    planning_s = time.perf_counter() - started
    with tempfile.TemporaryDirectory(prefix="srbval-scale-") as name:
        folder = Path(name)
        cpu_s, started = time.process_time(), time.perf_counter()
        done = run_campaign(campaign, folder, engine=engine, progress=progress)
        run_s, coordinator_s = time.perf_counter() - started, time.process_time() - cpu_s
        sizes = [path.stat().st_size for path in (folder / "cases").glob("*/*.h5")]
        return {
            "cases": done.cases, "engine": done.engine, "workers": done.workers, "planning_s": planning_s,
            "run_s": run_s, "coordinator_s": coordinator_s / cases, "peak_bytes": peak_bytes(),
            "base_bytes": base_bytes, "plan_and_journal_bytes": (folder / PLAN).stat().st_size,
            "file_bytes": sum(sizes) / len(sizes),
        }  # fmt: skip


def tiny(cases: int) -> Campaign:
    """A campaign of `cases` different cases, each some milliseconds of work."""
    table = {
        "name": "tiny",
        "outputs": ["summary"],
        "scene": {"model": "kinematic", "duration": "1 ms", "settle": "0 s", "defect": {"kind": "outer"}},
        "axes": [{"kind": "grid", "values": {"seed": list(range(cases))}}],
    }
    return build(Campaign, table, "tiny")


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--cases", metavar="N", type="count", default=10_000, help="number of cases (default: 10000)")
    parser.add_argument("--engine", choices=NAMES, default="auto", help="as for srbval campaign run")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    found = measure_scale(options.cases, choose_engine(options.engine), progress=progress)
    rows = [extrapolate(found, *size) for size in EXTRAPOLATED]
    return StudyResult(name="campaign_scale", content={"measured": found, "extrapolated": rows}, text=text_rows(rows))


STUDY = Study(
    question="What does a campaign of very many cases cost besides its simulations?", minutes=3, run=_run,
    options=_options,
)  # fmt: skip
