"""Tables of scenes: grids and draws, measured rows that are stored, bisection along an axis."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval import ConfigurationError, Scene, paper_scene
from srbval.models.health import default_solver
from srbval.models.run import RunStatus, works
from srbval.sweep.pool import Attempt, attempt, side_by_side
from srbval.sweep.scenes import OUTPUT_RATE_HZ, PAPER, bench_scene, lasting_passages
from srbval.sweep.sweep import Case, bisect, draws, grid, records, sweep

RUNS: list[float] = []


def scene_of(case: Case) -> Scene:
    return paper_scene(model="kinematic", duration="0.05 s", shaft_speed=f"{case['rpm']} rpm")


def measure(case: Case, *tried: Attempt) -> dict[str, Any]:
    RUNS.append(case["rpm"])
    return {"bpfo_hz": [one.run.bpfo_hz for one in tried if one.run is not None][-1]}


def test_a_grid_has_every_combination_and_draws_fill_their_ranges():
    assert grid(a=[1, 2], b=["x", "y"]).to_dict("list") == {"a": [1, 1, 2, 2], "b": ["x", "y", "x", "y"]}
    drawn = draws({"low": (0.0, 1.0), "high": (10.0, 20.0)}, 8, seed=3)
    assert drawn.equals(draws({"low": (0.0, 1.0), "high": (10.0, 20.0)}, 8, seed=3))
    assert sorted(np.floor(8 * drawn["low"])) == list(range(8)), "one in each eighth of the range"
    assert drawn["high"].between(10, 20).all()


def test_rows_are_measured_once_and_then_read():
    cases = grid(rpm=[300.0, 600.0])
    RUNS.clear()
    first = sweep(cases, scene_of, measure, task="two speeds")
    again = sweep(cases, scene_of, measure, task="two speeds")
    pair = sweep(cases, lambda case: (scene_of(case),) * 2, measure, task="pairs")
    assert first.equals(again)
    assert sorted(RUNS) == [300.0, 300.0, 600.0, 600.0], "two rows of one run, then two rows of two"
    assert first["bpfo_hz"].tolist() == pytest.approx(pair["bpfo_hz"].tolist())
    assert first["bpfo_hz"][1] == pytest.approx(2 * first["bpfo_hz"][0])
    assert first["status"].tolist() == ["ok", "ok"]


def test_bisection_finds_the_last_value_that_passes():
    values, groups = [100.0, 200.0, 300.0, 400.0, 500.0], grid(limit=[50.0, 320.0, 900.0])
    speeds = pd.Series(values, name="rpm")
    limits, cells = bisect(groups, speeds, scene_of, measure, lambda cell: cell["rpm"] <= cell["limit"])
    found = records(limits)
    assert [row["rpm"] for row in found] == [None, 300.0, 500.0]
    assert [row["bounded"] for row in found] == [True, True, False]
    assert sum(row["runs"] for row in found) == len(cells) < len(values) * len(groups)


def test_a_refused_scene_is_a_failed_attempt_and_no_jobs_are_refused():
    refused = attempt(paper_scene(model="nothing"))
    assert (refused.status, refused.run, refused.works, refused.measurable) == ("refused", None, False, False)
    with pytest.raises(ConfigurationError, match="jobs"):
        side_by_side({}, lambda *_: None, task="none", jobs=0)


@pytest.mark.parametrize("status", list(RunStatus))
def test_what_works_is_what_simulate_accepts(status):
    assert works(status) == works(status.value) == (status in ("ok", "skidding", "rollers-unloaded"))
    assert status.usable or not works(status)


def test_scenes_by_name():
    scene = bench_scene("interference-outer", solver=default_solver(), step_s=PAPER.step_s, rpm=355.0)
    assert scene.contact.roller_fit == "printed"
    assert scene.output_rate_hz == OUTPUT_RATE_HZ
    assert bench_scene("rig-inner", solver="ode4", step_s=1 / 30720).output_rate_hz == pytest.approx(15360.0)
    long = lasting_passages(scene, 10.0, least_s=0.01, settle=5.0)
    assert long.duration_s == pytest.approx(2 * long.settle_s, abs=1 / 128)
    assert math.isclose(long.duration_s * 256, round(long.duration_s * 256))
    with pytest.raises(ConfigurationError, match="play0-outer"):
        bench_scene("play0-outre", solver="ode4", step_s=PAPER.step_s)
