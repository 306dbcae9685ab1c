"""Small campaigns of a few milliseconds of simulated time, run within the test's own process, and their folders."""

import hashlib
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import Any

from srbval.campaign.results import CaseResult, CaseTask
from srbval.campaign.run import RESULTS, run_campaign, verify_campaign
from srbval.campaign.settings import Campaign
from srbval.campaign.worker import prepare, run_case
from srbval.storage.tables import build

FAILING = {"model": "planar", "load.radial": "100 MN"}  # the rollers lose the load
# Three good cases with signals, one on which the numerics fail, two that are refused.
MIXED = [
    {
        "kind": "list",
        "cases": [
            {"defect.kind": "outer", "model": "planar"},
            {"defect.kind": "inner", "model": "kinematic"},
            {"model": "planar"},
            FAILING,
            {"load.radial": "-3 kN"},
            {"bearing": "skf-6205", "model": "full"},
        ],
    }
]


def small(**changes: Any) -> Campaign:
    """Six cases of a simple model, 5 ms each."""
    table: dict[str, Any] = {
        "name": "small",
        "outputs": ["summary", "statistics", "acceleration"],
        "scene": {"duration": "5 ms", "settle": "0 s", "model": "planar"},
        "axes": [
            {"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}},
            {"kind": "grid", "values": {"defect.kind": ["none", "outer"]}},
        ],
    }
    return build(Campaign, table | changes, "campaign")


class InProcess:
    """An engine that runs one case after the other in this process, without limits."""

    name = "in-process"

    def run(self, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
        for task in tasks:
            prepare(task.scene)
            yield run_case(task)


def run_small(campaign: Campaign, folder: Path, **options: Any) -> dict[str, Any]:
    return run_campaign(campaign, folder, engine=InProcess(), **options)


def resume(folder: Path, **changes: Any) -> dict[str, Any]:
    """Run the campaign `MIXED` again; returns its summary."""
    return run_small(small(axes=MIXED, **changes), folder)


def content(folder: Path) -> dict[str, str]:
    """Digest of every result, and of the table of results, by name."""
    files = [*(folder / "cases").glob("*.h5"), folder / RESULTS]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def good_results(folder: Path) -> list[Path]:
    """The results with signals."""
    return sorted(path for path in (folder / "cases").glob("*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder: Path) -> set[str]:
    return {found["file"].name for found in verify_campaign(folder)["damaged"]}
