"""The section on detection under noise and on the overhead of campaigns, from stored results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbval.report.blocks import Callout
from srbval.report.findings.stored import ShownResult, shown_result
from srbval.report.table import Table
from srbval.storage.stored_result import StoredResult, stamped
from srbval.studies.noise.page import campaign_section

MACHINE = {"processor": "none", "usable_cores": 1}
MEASURED = {"cases": 40, "engine": "local", "planning_s": 0.1, "coordinator_s": 1e-3}
EXTRAPOLATED: dict[str, Any] = {
    "cases": 10_000, "workers": 64, "planning_s": 25.0, "simulation_s": 781.25, "coordinator_s": 10.0,
    "workers_before_the_coordinator_is_full": 5000, "peak_bytes": 2e8, "files_a_folder": 39.0625,
    "result_bytes": 1e8, "plan_and_journal_bytes": 1e7,
}  # fmt: skip


def stored(kind: str, result: dict[str, Any]) -> ShownResult:
    content = stamped(kind, {"machine": MACHINE, **result}, command="a test", revision=None)
    return shown_result(kind, StoredResult(path=Path(f"{kind}.json"), content=content))


def noise_row(snr_db: float | None, found: int) -> dict[str, Any]:
    drawn = {"colour": "none" if snr_db is None else "white", "snr_db": snr_db, "draws": 2, "found": found}
    return {"state": "outer", "line": "BPFO", "line_snr": 10.0 * found, "deviation_pct": 0.1, **drawn}


def test_the_lowest_ratio_at_which_every_draw_finds_the_line_is_stated() -> None:
    rows = [noise_row(None, 2), noise_row(20.0, 2), noise_row(10.0, 2), noise_row(0.0, 1)]
    section = campaign_section(stored("noise_study", {"rows": rows}), shown_result("campaign_scale", None))
    assert "outer race in white noise: down to **10 dB**" in str(section.all_blocks[1])
    assert sum(isinstance(block, Callout) for block in section.all_blocks) == 1  # the scale is missing


def test_the_overhead_is_a_table() -> None:
    section = campaign_section(
        shown_result("noise_study", None),
        stored("campaign_scale", {"measured": MEASURED, "extrapolated": [EXTRAPOLATED]}),
    )
    tables = [block for block in section.all_blocks if isinstance(block, Table)]
    assert [(table.id, len(table.rows)) for table in tables] == [("scale-table", 1)]
