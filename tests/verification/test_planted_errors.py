"""A wrong sign or a missing term, planted in the kernels, must make some check fail.

Reason: checks that cannot fail prove nothing. Every row of `planted_errors.toml` is planted alone, see `planted.py`;
the test that the row names then runs in a process of its own, uncompiled, which is faster than compiling it. The
unharmed kernels must pass these tests, and every planted error must fail its own; a row without one, some of `CHECKS`.
"""

import json
import os
import queue
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from srbval.storage.installation import child_environment
from tests.verification.planted import KERNELS

HERE = Path(__file__).parent
CHECKS = (
    "test_equations_of_motion.py",
    "test_free_motion.py",
    "test_outputs.py",
    "test_damping_matrix.py",
    "test_implicit_steps.py",
)
PROCESSES = 2
FAILED = 1  # exit status of pytest when tests ran and some failed; others mean that they did not run


@dataclass(frozen=True)
class PlantedError:
    """`new` takes the place of `old` in the kernel file `file`, which `caught_by` notices."""

    what: str
    file: str
    old: str
    new: str
    caught_by: str | None = None


ERRORS = [PlantedError(**row) for row in tomllib.loads((HERE / "planted_errors.toml").read_text())["error"]]
# The short form plants every eighth; SRBVAL_PLANTED=all plants them all.
PLANTED = ERRORS if os.environ.get("SRBVAL_PLANTED") == "all" else ERRORS[::8]
UNHARMED = PlantedError("nothing", "motion_kernel.py", "", "")
NAMED = sorted({error.caught_by for error in PLANTED if error.caught_by})
Outcome = tuple[int, str]  # exit status of pytest, and what it printed


@pytest.fixture(scope="module")
def outcomes(request):
    asked = {item.name for item in request.session.items}
    wanted = [error for error in ERRORS if f"{test_planted_error_is_caught.__name__}[{error.what}]" in asked]
    command = [sys.executable, "-m", "tests.verification.planted"]
    environment = os.environ | child_environment() | {"NUMBA_DISABLE_JIT": "1"}
    idle: queue.Queue[subprocess.Popen[str]] = queue.Queue()
    for _ in range(PROCESSES):
        idle.put(
            subprocess.Popen(
                command, cwd=HERE.parents[1], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        )

    def outcome(error: PlantedError) -> Outcome:
        process = idle.get()
        names = NAMED if error is UNHARMED else [error.caught_by] if error.caught_by else CHECKS
        row = {"file": error.file, "old": error.old, "new": error.new, "tests": [str(HERE / name) for name in names]}
        process.stdin.write(json.dumps(row) + "\n")
        process.stdin.flush()
        code, text = json.loads(process.stdout.readline())
        idle.put(process)
        return code, text

    with ThreadPoolExecutor(PROCESSES) as pool:
        yield {error.what: pool.submit(outcome, error) for error in (UNHARMED, *wanted)}
    for _ in range(PROCESSES):
        idle.get().communicate()  # ends with its input


def test_anchors_are_found_once():
    sources = {path.name: path.read_text() for path in KERNELS.glob("*_kernel.py")}
    assert [error.what for error in ERRORS if sources[error.file].count(error.old) != 1] == []


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_unharmed_kernels_pass(outcomes):
    code, printed = outcomes[UNHARMED.what].result()
    assert code == 0, printed


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("error", PLANTED, ids=lambda error: error.what)
def test_planted_error_is_caught(error, outcomes):
    code, printed = outcomes[error.what].result()
    assert code == FAILED, f"no check noticed: {error.what}\n{printed}"
