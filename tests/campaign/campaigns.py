"""Small campaigns of a few milliseconds of simulated time, run within the test's own process, and their folders."""

import hashlib
from collections.abc import Generator
from pathlib import Path
from typing import Any

from srbval.campaign.case import CaseResult
from srbval.campaign.engines.local import Job
from srbval.campaign.folder import PLAN
from srbval.campaign.run import CampaignSummary, run_campaign
from srbval.campaign.settings import Campaign
from srbval.campaign.status import verify_campaign
from srbval.campaign.work import prepare, run_case
from srbval.storage.tables import build

# A scene that the numerics lose: explicit Euler, four steps of the paper's at once.
FAILING = {"solver.name": "ode1", "solver.step_s": 4 / 61440, "output_rate_hz": 15360.0, "duration": "30 ms",
           "defect.kind": "outer"}  # fmt: skip
# Three good cases with signals, one that the numerics lose, two that are refused.
MIXED = [{"kind": "list", "cases": [
    {"defect.kind": "outer", "model": "planar"}, {"defect.kind": "inner", "model": "kinematic"}, {"model": "planar"},
    FAILING | {"model": "full"}, {"load.radial": "-3 kN"}, {"bearing": "skf-6205", "model": "full"},
]}]  # fmt: skip


def small(**changes: Any) -> Campaign:
    """Six cases of the full model, 5 ms each."""
    table: dict[str, Any] = {
        "name": "small",
        "outputs": ["summary", "statistics", "acceleration"],
        "scene": {"duration": "5 ms", "settle": "0 s"},
        "axes": [
            {"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}},
            {"kind": "grid", "values": {"defect.kind": ["none", "outer"]}},
        ],
    }
    return build(Campaign, table | changes, "campaign")


def six(model: str = "planar") -> Campaign:
    """The same six cases with a lesser model: for what does not depend on it."""
    return small(scene={"duration": "5 ms", "settle": "0 s", "model": model})


class InProcess:
    """An engine: compile, then one case after the other, without limits and without a process."""

    name, workers = "in-process", 1

    def run(self, job: Job) -> Generator[CaseResult]:
        prepare(job.precompiled)
        for task in job.tasks:
            yield run_case(task)


def run_small(campaign: Campaign, folder: Path, **options: Any) -> CampaignSummary:
    return run_campaign(campaign, folder, engine=InProcess(), **options)


def resume(folder: Path, **changes: Any) -> tuple[CampaignSummary, list[str]]:
    said: list[str] = []
    return run_small(small(axes=MIXED, **changes), folder, message=said.append), said


def content(folder: Path) -> dict[str, str]:
    """Digest of every result by name, and of the table."""
    files = [*(folder / "cases").glob("*/*.h5"), folder / "results.csv"]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def lines_of(folder: Path) -> list[bytes]:
    """Of `MIXED` that has ended: about, six cases, about, six results."""
    return (folder / PLAN).read_bytes().splitlines(keepends=True)


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name != "lock"}


def good_results(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "cases").glob("*/*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder: Path) -> set[str]:
    return {found.file.name for found in verify_campaign(folder).damaged}
