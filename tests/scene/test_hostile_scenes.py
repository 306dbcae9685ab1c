"""No scene, bearing or campaign file hangs, crashes or eats memory: it is refused, or its run ends with a status.

`SRBVAL_SCENES=5000` runs so many cases (an hour of one core); the default is a taste of them.
"""

import json
import os
import selectors
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from srbval.models.hierarchy import LEVELS
from srbval.models.jit import precompile
from srbval.models.run import RunStatus
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene

CASES = int(os.environ.get("SRBVAL_SCENES", "40"))
HANGS_S = 10.0  # without a line, of processor time
LOADING_S = 120.0  # of the first case: imports and kernels
MOST_MB = 500.0
ROOT = Path(__file__).parents[2]


def cpu_s(pid: int) -> float:
    """Processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def lines(folder: Path, first: int, count: int) -> Iterator[dict[str, Any]]:
    """What the process says; ``None`` fields are never made up: a hang or a crash ends it with what began last."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.scene.hostile_scenes", str(folder), str(first), str(count), "1"],
        stdout=subprocess.PIPE, cwd=ROOT,
    )  # fmt: skip
    with process, selectors.DefaultSelector() as waiting:
        waiting.register(process.stdout, selectors.EVENT_READ)
        last: dict[str, Any] = {}
        while True:
            limit = HANGS_S if last.get("seconds") else LOADING_S
            used_s, begun = cpu_s(process.pid), time.monotonic()
            while not (said := waiting.select(1.0)) and cpu_s(process.pid) - used_s < limit:
                if time.monotonic() - begun > 10 * limit:  # it waits for something
                    break
            if not said:
                process.kill()
                yield {"hangs": last}
                return
            line = process.stdout.readline()
            if not line:
                break
            last = {"seconds": last.get("seconds")} | json.loads(line)
            yield last
    if process.returncode:
        yield {"crashed": last, "code": process.returncode}


def outcomes(folder: Path) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Of all cases: those that ended, and those that did not as they should."""
    said = list(lines(folder, 0, CASES))
    problems = [line for line in said if {"hangs", "crashed", "broken"} & set(line)]
    return [line for line in said if "ran" in line], problems


@pytest.mark.timeout(0)
def test_hostile_values_end_with_a_message_or_a_status(tmp_path: Path) -> None:
    models = ("full", "line", "planar", "slices")
    precompile(*(paper_scene(model=model, solver={"name": solver}) for model in models for solver in METHODS))
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
