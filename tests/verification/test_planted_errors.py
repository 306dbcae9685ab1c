"""A wrong sign or a missing term, planted in the kernels, must make some check fail.

Reason: checks that cannot fail prove nothing. Every row of `planted_errors.toml` is planted alone in a copy of the
package; the checks named below then run on that copy in a process of its own, uncompiled, which is faster than
compiling it. The unharmed copy must pass them, and every planted error must fail at least one.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

import srbval

HERE = Path(__file__).parent
TABLE = HERE / "planted_errors.toml"
KERNELS = Path("srbval/models/full")
CHECKS = (
    "test_equations_of_motion.py",
    "test_free_motion.py",
    "test_outputs.py",
    "test_damping_matrix.py",
    "test_implicit_steps.py",
)  # the quickest; they need few right-hand sides
LIKELIEST = {  # run first
    "damping_kernel.py": "test_damping_matrix.py",
    "power_kernel.py": "test_implicit_steps.py",
    "step_kernel.py": "test_implicit_steps.py",
}
PROCESSES = 2
FAILED = 1  # exit status of pytest when tests ran and some failed; others mean that they did not run
LONGEST_S = 120


@dataclass(frozen=True)
class PlantedError:
    """`new` takes the place of `old` in the kernel file `file`."""

    what: str
    file: str
    old: str
    new: str


ERRORS = [PlantedError(**row) for row in tomllib.loads(TABLE.read_text())["error"]]
# The short form plants every fourth, which takes some two minutes; SRBVAL_PLANTED=all plants them all.
PLANTED = ERRORS if os.environ.get("SRBVAL_PLANTED") == "all" else ERRORS[::4]
UNHARMED = PlantedError("nothing", "motion_kernel.py", "", "")


@pytest.fixture(scope="module")
def outcomes(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Future[subprocess.CompletedProcess[str]]]]:
    """The checks' outcome for each planted error that was asked for and for none, some at once."""
    asked = {item.name for item in request.session.items}
    wanted = [error for error in ERRORS if f"{test_planted_error_is_caught.__name__}[{error.what}]" in asked]
    with ThreadPoolExecutor(PROCESSES) as pool:
        yield {
            error.what: pool.submit(run_checks, tmp_path_factory.mktemp("planted"), error)
            for error in (UNHARMED, *wanted)
        }


def run_checks(folder: Path, error: PlantedError) -> subprocess.CompletedProcess[str]:
    """Copy the package and its checks to `folder`, plant the error there, run the checks up to the first failure."""
    skip = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(srbval.__file__).parent, folder / "srbval", ignore=skip)
    shutil.copytree(HERE, folder / "tests" / "verification", ignore=skip)
    (folder / "tests" / "__init__.py").touch()
    (folder / "pytest.ini").write_text("[pytest]\nmarkers =\n    slow:\n    verification:\n")
    plant(folder / KERNELS / error.file, error)
    likeliest_first = sorted(CHECKS, key=lambda name: name != LIKELIEST.get(error.file))
    checks = [f"tests/verification/{name}" for name in likeliest_first]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-rf", "-p", "no:cacheprovider", *checks]
    return subprocess.run(
        command, cwd=folder, env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(folder)},
        capture_output=True, text=True, timeout=LONGEST_S, check=False,
    )  # fmt: skip


def plant(path: Path, error: PlantedError) -> None:
    source = path.read_text()
    assert error is UNHARMED or source.count(error.old) == 1, f"{error.old!r} in {error.file}"
    path.write_text(source if error is UNHARMED else source.replace(error.old, error.new))


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: error.what)
def test_anchor_is_found_once(error: PlantedError) -> None:
    """So that the table follows the code."""
    source = (Path(srbval.__file__).parents[1] / KERNELS / error.file).read_text()
    assert source.count(error.old) == 1, f"{error.old!r} in {error.file}"


@pytest.mark.slow
def test_unharmed_copy_passes(outcomes: dict[str, Future[subprocess.CompletedProcess[str]]]) -> None:
    outcome = outcomes[UNHARMED.what].result()
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


@pytest.mark.slow
@pytest.mark.parametrize("error", PLANTED, ids=lambda error: error.what)
def test_planted_error_is_caught(
    error: PlantedError, outcomes: dict[str, Future[subprocess.CompletedProcess[str]]]
) -> None:
    outcome = outcomes[error.what].result()
    assert outcome.returncode == FAILED, f"no check noticed: {error.what}\n{outcome.stdout}{outcome.stderr}"
