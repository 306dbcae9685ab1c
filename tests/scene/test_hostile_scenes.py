"""No scene, bearing or campaign file hangs, crashes or eats memory: it is refused, or its run ends with a status.

`SRBVAL_SCENES=5000` runs so many cases (an hour of one core); the default is a taste of them.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from srbval.models.hierarchy import LEVELS
from srbval.models.jit import precompile
from srbval.models.run import RunStatus
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene

CASES = int(os.environ.get("SRBVAL_SCENES", "40"))
LONGEST_S = 10.0  # of computing, of one case; the first also loads
LOADING_S = 120.0
MOST_MB = 500.0
ROOT = Path(__file__).parents[2]


def outcomes(folder: Path) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Of all cases: those that ended, and those that did not as they should; of a hang or a crash what began last."""
    command = [sys.executable, "-m", "tests.scene.hostile_scenes", str(folder), "0", str(CASES), "1"]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, cwd=ROOT, timeout=600 + 20 * CASES, check=False)
        printed, code = done.stdout, done.returncode
    except subprocess.TimeoutExpired as hung:
        printed, code = hung.stdout or b"", "hangs"
    said = [json.loads(line) for line in printed.splitlines()]
    ended = [line for line in said if "ran" in line]
    slow = [line for line in ended if line["seconds"] > LONGEST_S + LOADING_S * (line["case"] == 0)]
    last = [said[-1] | {"code": code}] if code else []
    return ended, [line for line in said if "broken" in line] + slow + last


@pytest.mark.timeout(0)
def test_hostile_values_end_with_a_message_or_a_status(tmp_path: Path) -> None:
    scenes = [paper_scene(model=model, solver={"name": name}) for model in ("full", "slices") for name in METHODS]
    precompile(*scenes, paper_scene(model="line"), paper_scene(model="planar"))
    ended, problems = outcomes(tmp_path)
    if not problems and ended[-1]["mb"] >= MOST_MB:  # kernels were compiled in it: again, now that they are stored
        ended, problems = outcomes(tmp_path)
    runs = Counter(tuple(run) for line in ended for run in line["ran"] if len(run) == 3)
    statuses = Counter(status for _, _, status in runs.elements())
    refused = sum("refused" in line for line in ended)
    print(f"\n{len(ended)} cases, {refused} refused; runs by status: {dict(statuses)}; "
          f"slowest case {max(line['seconds'] for line in ended):.1f} s, {ended[-1]['mb']:.0f} MB")  # fmt: skip
    assert problems == []
    assert len(ended) == CASES
    assert ended[-1]["mb"] < MOST_MB
    assert set(statuses) <= set(RunStatus)
    assert sum(statuses.values()) > CASES / 6, "the solver is reached"
    if CASES >= 1000:
        assert {model for model, _, _ in runs} == {rung.name for rung in LEVELS}
        assert {solver for _, solver, _ in runs} >= set(METHODS)
        assert len(statuses) >= 5
