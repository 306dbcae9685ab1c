"""The overhead of very many cases."""

import json
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from srbval.campaign.engines.local import LocalProcesses
from srbval.campaign.planning import plan_cases
from srbval.studies.campaign_scale.study import EXTRAPOLATED, extrapolate, measure_scale, tiny

ROOT = Path(__file__).parents[2]
LIMIT_BYTES = 300e6  # of the coordinating process, with ten thousand cases
PROGRAM_SHARE = 0.5  # of that limit, about what the program itself takes
MANY = 10_000
MEASURED = 2_000  # cases that are really run: enough for their memory to stand out beside the program's


def test_scale_is_measured_and_extrapolated() -> None:
    found = measure_scale(40, LocalProcesses(2))
    assert (found["cases"], found["engine"]) == (40, "local")
    assert found["planning_s"] < found["run_s"]
    few, many = (extrapolate(found, *size) for size in EXTRAPOLATED)
    assert many["planning_s"] == pytest.approx(100 * few["planning_s"])
    assert many["files_a_folder"] == pytest.approx(1e6 / 256)


def test_the_plan_of_ten_thousand_cases_is_small() -> None:
    planned = 500
    plan_cases(tiny(1))  # what is read once is not counted
    tracemalloc.start()
    try:
        cases = plan_cases(tiny(planned))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len({case.key for case in cases}) == planned
    assert MANY / planned * held < (1 - PROGRAM_SHARE) * LIMIT_BYTES


@pytest.mark.slow
def test_ten_thousand_cases_stay_within_the_memory(tmp_path: Path) -> None:
    """Measured with fewer, in a process of its own, so that what other tests loaded does not count."""
    stored = tmp_path / "scale.json"
    command = [sys.executable, "-m", "srbval", "study", "run", "campaign_scale", "--cases", str(MEASURED)]
    subprocess.run([*command, "--engine", "local", "-o", str(stored)], cwd=ROOT, capture_output=True, check=True)
    content = json.loads(stored.read_text(encoding="utf-8"))
    assert content["kind"] == "campaign_scale"
    assert content["extrapolated"][0]["cases"] == MANY
    assert content["measured"]["cases"] == MEASURED
    peak_bytes = extrapolate(content["measured"], MANY, 1)["peak_bytes"]
    assert peak_bytes is None or peak_bytes < LIMIT_BYTES
