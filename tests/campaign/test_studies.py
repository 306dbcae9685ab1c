"""Detection under noise, and what many cases cost."""

from __future__ import annotations

from pathlib import Path

import pytest

from srbval.bench.noise_study import noise_study
from srbval.campaign.engines.local import LocalProcesses
from srbval.campaign.planning import plan_cases
from srbval.campaign.scale import CampaignScale, extrapolations, measure_scale, tiny
from srbval.report.blocks import Callout
from srbval.report.content.campaign_section import campaign_section
from srbval.report.table import Table
from srbval.storage.stored_result import CAMPAIGN_SCALE, NOISE_STUDY, StoredResult, stamped, store_result
from srbval.storage.strict_json import json_value

MACHINE = {"processor": "none", "usable_cores": 1}
LIMIT_BYTES = 300e6  # of the coordinating process, with ten thousand cases


def kept(kind: str, result: dict[str, object], folder: Path) -> StoredResult:
    content = stamped(kind, {"machine": MACHINE, **result}, command="a test", revision=None)
    return StoredResult(path=store_result(content, folder / f"{kind}.json"), content=content)


@pytest.mark.slow
def test_detection_falls_with_noise(tmp_path: Path) -> None:
    rows = noise_study(ratios_db=(20.0, -45.0), seconds=1.0, draws=2)
    by_ratio = {(row.state, row.snr_db): row for row in rows}
    for state in ("outer", "inner"):
        bare, little, much = (by_ratio[state, ratio] for ratio in (None, 20.0, -45.0))
        assert (bare.found, bare.draws, bare.deviation_pct) == (1, 1, 0.0)
        assert little.found == little.draws == 2
        assert much.found == 0
        assert (little.line_snr or 0) > 5 * (much.line_snr or 0)
    section = campaign_section(kept(NOISE_STUDY, {"rows": json_value(rows)}, tmp_path), None)
    assert "outer race in white noise: down to **20 dB**" in str(section.blocks[1])
    assert sum(isinstance(block, Callout) for block in section.blocks) == 1


def test_scale_is_measured_and_reckoned(tmp_path: Path) -> None:
    found = measure_scale(40, LocalProcesses(2))
    assert (found.cases, found.engine) == (40, "local")
    assert found.planning_s < found.run_s
    few, many = extrapolations(found)
    assert many["planning_s"] == pytest.approx(100 * few["planning_s"])
    assert many["files_a_folder"] == pytest.approx(1e6 / 256)
    content = {"measured": vars(found), "reckoned": [few, many]}
    tables = [b for b in campaign_section(None, kept(CAMPAIGN_SCALE, content, tmp_path)).blocks if isinstance(b, Table)]
    assert [table.id for table in tables] == ["scale-table"]


def test_the_plan_of_ten_thousand_cases_is_small() -> None:
    import tracemalloc

    tracemalloc.start()
    try:
        cases = plan_cases(tiny(2000))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len({case.key for case in cases}) == 2000
    # what the program itself holds is about half the limit
    assert 5 * held < LIMIT_BYTES / 2


@pytest.mark.slow
def test_ten_thousand_cases_stay_within_the_memory(tmp_path: Path) -> None:
    """A process of its own, so that what other tests loaded does not count."""
    import json
    import subprocess
    import sys

    command = [sys.executable, "-m", "srbval", "campaign", "scale", "--cases", "10000", "--engine", "local", "--json"]
    done = subprocess.run([*command, "-o", str(tmp_path / "s.json")], capture_output=True, text=True, check=True)
    measured = CampaignScale(**json.loads(done.stdout)["measured"])
    assert measured.cases == 10_000
    assert measured.peak_bytes is None or measured.peak_bytes < LIMIT_BYTES
