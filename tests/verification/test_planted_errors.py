"""A wrong sign or a missing term, planted in the kernels, must make the test fail that is named beside it.

Reason: checks that cannot fail prove nothing. Every row of `planted_errors.toml` is planted alone, see `planted.py`;
the test that the row names then runs in a process of its own, uncompiled, which is faster than compiling it. The
unharmed kernels must pass these tests, uncompiled too.
"""

import os
import tomllib
from pathlib import Path

import pytest

from tests.verification.planted import KERNELS, processes, run_tests

HERE = Path(__file__).parent
PROCESSES, LONGEST_S = 2, 600
FAILED = 1  # exit status of pytest when tests ran and some failed; others mean that they did not run
ERRORS = tomllib.loads((HERE / "planted_errors.toml").read_text())["error"]
# The short form plants every eighth; SRBVAL_PLANTED=all plants them all.
PLANTED = ERRORS if os.environ.get("SRBVAL_PLANTED") == "all" else ERRORS[::8]
# Tests with cases that the short form does not compile.
UNCOMPILED = ("test_damping_matrix.py", "test_equations_of_motion.py", "test_implicit_steps.py")
UNHARMED = {"what": "nothing", "file": "motion_kernel.py", "old": "", "new": ""}


@pytest.fixture(scope="module")
def outcomes(request):
    """Pending results of `run_tests` by error: without an error, and for each error whose test was requested."""
    if not hasattr(os, "fork"):
        pytest.skip("no fork here")
    asked = {item.name for item in request.session.items}
    wanted = [error for error in PLANTED if f"{test_planted_error_is_caught.__name__}[{error['what']}]" in asked]
    single = {error["caught_by"] for error in ERRORS if not error["caught_by"].startswith(UNCOMPILED)}
    tests = [[*UNCOMPILED, *sorted(single)], *([error["caught_by"]] for error in wanted)]
    with processes(PROCESSES) as pool:
        yield {
            error["what"]: pool.apply_async(run_tests, (error, [str(HERE / name) for name in names]))
            for error, names in zip([UNHARMED, *wanted], tests, strict=True)
        }


def test_anchors_are_found_once():
    sources = {path.name: path.read_text() for path in KERNELS.glob("*_kernel.py")}
    assert [error["what"] for error in ERRORS if sources[error["file"]].count(error["old"]) != 1] == []


@pytest.mark.slow
def test_unharmed_kernels_pass(outcomes):
    code, printed = outcomes[UNHARMED["what"]].get(LONGEST_S)
    assert code == 0, printed


@pytest.mark.slow
@pytest.mark.parametrize("what", [error["what"] for error in PLANTED])
def test_planted_error_is_caught(what, outcomes):
    code, printed = outcomes[what].get(LONGEST_S)
    assert code == FAILED, f"no check noticed: {what}\n{printed}"
