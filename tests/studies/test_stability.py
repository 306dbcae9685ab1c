"""The stability study: its word is `simulate`'s, lines have one length, and the paper's claims are counted."""

from argparse import Namespace
from typing import Any

import pandas as pd
import pytest

from srbval.models.run import works
from srbval.models.simulate import Step, simulate
from srbval.progress import silent
from srbval.storage.json_files import to_json
from srbval.studies import bench
from srbval.studies.stability import study
from srbval.studies.stability.study import claims
from srbval.sweep.scenes import PAPER

CELL_KEYS = {"model", "solver", "dt_s", "rpm", "status", "reason", "stable", "predicted_limit_dt_s"}
LIMIT_KEYS = {"model", "solver", "rpm", "largest_stable_dt_s", "predicted_limit_dt_s", "runs", "certain"}
LOWER = [(f"ode{n}", 710.0) for n in (1, 2, 3)]


@pytest.fixture(scope="module")
def result(_own_results):
    asked = Namespace(scenes=["interference-outer"], solvers=["ode1", "imex2"], rpm=[710.0], jobs=None)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(bench, "STEPS_PER_S", (122880, 61440, 15360))
        content: dict[str, Any] = to_json(study.run(asked, silent).content)
    return content


def test_cells_and_limits(result):
    assert all(set(cell) >= CELL_KEYS for cell in result["cells"])
    assert all(set(limit) >= LIMIT_KEYS for limit in result["limits"])
    limits = {limit["solver"]: limit for limit in result["limits"]}
    assert limits["imex2"]["largest_stable_dt_s"] == pytest.approx(1 / 61440)
    assert limits["ode1"]["largest_stable_dt_s"] is None
    assert {limit["runs"] for limit in limits.values()} == {2}
    assert all(cell["stable"] == works(cell["status"]) for cell in result["cells"])
    reasons = {(cell["solver"], cell["steps_per_s"]): cell["reason"] for cell in result["cells"]}
    assert limits["imex2"]["certain"] is ("chance hides" not in reasons["imex2", 61440])


def test_a_cell_ends_as_simulate_does(result):
    cells = [cell for cell in result["cells"] if cell["solver"] == "imex2"]
    for cell in cells:
        run = simulate(bench.passing_scene(cell), step=Step.CHECKED)
        assert (run.status, run.reason) == (cell["status"], cell["reason"])
    assert {cell["stable"] for cell in cells} == {True, False}


def test_every_line_has_a_run_at_the_papers_step_and_runs_of_one_length():
    """The first run of a bisection has the middle step."""
    assert pytest.approx(PAPER.step_s) == 1 / bench.STEPS_PER_S[(len(bench.STEPS_PER_S) - 1) // 2]
    case = {"scene": "play0-outer", "model": "full", "solver": "ode4", "rpm": 127.0}
    scenes = [bench.passing_scene(case | {"steps_per_s": steps}) for steps in bench.STEPS_PER_S]
    assert len({(scene.duration_s, scene.settle_s) for scene in scenes}) == 1
    assert all((scene.duration_s * scene.output_rate_hz).is_integer() for scene in scenes)


def cell(solver: str, rpm: float, stable: bool, **changes: Any) -> dict[str, Any]:
    own = {"solver": solver, "rpm": rpm, "stable": stable, "dt_s": PAPER.step_s, "model": "full"}
    return own | changes


@pytest.mark.parametrize(
    ("claim", "failed", "borne_out"),
    [
        (0, [("ode1", 710.0)], False), (0, LOWER, True), (0, [*LOWER, ("ode4", 710.0)], False),
        (1, [("ode1", 3000.0)], False), (1, [("ode4", 3000.0)], True), (1, [("ode4", 6000.0)], False),
        (1, [("ode4", 3000.0), ("ode4", 710.0)], False),
    ],
)  # fmt: skip
def test_claims_are_answered_by_counting_cells(claim, failed, borne_out):
    """ode4 is the lowest stable order up to 1000 rpm; it fails at every speed above, and only there."""
    every = {(f"ode{n}", rpm) for n in (1, 2, 3, 4) for rpm in (710.0, 3000.0)} | set(failed)
    cells = [cell(solver, rpm, (solver, rpm) not in failed) for solver, rpm in sorted(every)]
    others = [cell("ode4", 710.0, False, model="slices"), cell("ode4", 710.0, False, dt_s=PAPER.step_s / 2)]
    assert claims(pd.DataFrame(cells + others))[claim]["borne_out"] is borne_out
    alone = claims(pd.DataFrame([cell("imex2", 710.0, True)]))
    assert [one["borne_out"] for one in alone] == [None, None], "not covered"
