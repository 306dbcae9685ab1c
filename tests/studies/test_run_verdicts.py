"""Wrong verdicts are found, of either kind; the random part differs from run to run."""

import json
from pathlib import Path
from typing import Any

import pytest

from srbval.bearing import load_bearing
from srbval.models.estimates import BLOCKS
from srbval.models.full.columns import layout_of
from srbval.models.full_run import elastic_limit_s, full_run
from srbval.models.health import CAUTION
from srbval.models.run import USABLE
from srbval.models.solvers import SOLVERS
from srbval.studies.outcomes import RunOutcome
from srbval.studies.run_verdicts.study import (
    MOST_FALSE,
    RANDOM_MODELS,
    Case,
    Condition,
    drawn_cases,
    fixed_cases,
    judge_runs,
    random_cases,
    scored,
    similar,
)
from srbval.studies.scenes import bench_scene

RMS = "RMS in 500-1500 Hz"


def outcome(status: str = "ok", reason: str = "fine", rms: float | None = 1.0) -> RunOutcome:
    return RunOutcome(
        status=status, reason=reason, cage_ratio=0.43, load_share=1.0, band_rms_m_s2=1.0, energy_imbalance=0.0,
        seconds=0.5, settle_s=0.1, wall_s=0.1, means={} if rms is None else {RMS: [rms**2] * BLOCKS},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("own", "reference", "falsely_ok", "falsely_failed"),
    [
        ({"rms": 1.04}, "ok", False, False),
        ({"rms": 1.3}, "ok", True, False),
        ({"rms": 1.3, "reason": f"fine; {CAUTION}who knows"}, "ok", False, False),
        ({"rms": 1.3, "status": "inaccurate"}, "ok", False, False),
        ({"status": "energy-open"}, "ok", False, True),
        ({"rms": 1.3, "status": "energy-open"}, "ok", False, False),
        ({"rms": None, "status": "energy-open"}, "ok", False, False),
        ({"status": "energy-open"}, "energy-open", False, True),  # a model whose energy is open at any step
        ({"status": "energy-open"}, "too-deep", False, False),
        ({"rms": None, "status": "refused"}, "ok", False, False),
    ],
)
def test_wrong_verdicts(own: dict[str, Any], reference: str, falsely_ok: bool, falsely_failed: bool) -> None:
    case = Case(Condition(scene="rig-outer", rpm=859.0), "imex2", 1.0, drawn=False)
    run = scored(case, outcome(**own), outcome(reference))
    assert (run["falsely_ok"], run["falsely_failed"]) == (falsely_ok, falsely_failed)


def test_drawn_cases_follow_from_their_seed_and_random_ones_are_of_every_kind() -> None:
    assert len(list(drawn_cases(1))) == pytest.approx(len(set(fixed_cases())), rel=0.05)
    assert list(drawn_cases(1)) == list(drawn_cases(1)) != list(drawn_cases(2))
    cases = list(random_cases(1, 200))
    assert cases == list(random_cases(1, 200)) != list(random_cases(2, 200))
    assert {c.condition.model for c in cases} == set(RANDOM_MODELS)
    assert {c.solver for c in cases} == set(SOLVERS)
    assert {c.chooses for c in cases} == {True, False}
    assert min(c.condition.rpm for c in cases) < 70 < 7000 < max(c.condition.rpm for c in cases)


def test_every_condition_is_a_scene(tmp_path: Path) -> None:
    for case in drawn_cases(3):
        scene = case.condition.at(case.solver, case.times, tmp_path)
        assert scene.solver.name == case.solver
        assert scene.load.radial_n == pytest.approx(case.condition.load * 124.8e3 * case.condition.size**2)
        assert case.condition.friction in (None, scene.contact.static_friction)


def test_a_similar_bearing_is_as_fast_as_it_is_small(tmp_path: Path) -> None:
    """Half the size: the same orders, and half the longest stable step; a sign or a power wrong would show."""
    scene = bench_scene("interference-outer", solver="imex2", seconds=0.1, settle_s=0.0)
    half = similar(scene, 0.5, tmp_path)
    bearings = [load_bearing(one.bearing) for one in (scene, half)]
    assert bearings[1].orders.bpfo == pytest.approx(bearings[0].orders.bpfo)
    runs = [full_run(one, bearing) for one, bearing in zip((scene, half), bearings, strict=True)]
    limits = [elastic_limit_s(run.method, run.model, run.state) for run in runs]
    assert limits[1] == pytest.approx(limits[0] / 2, rel=1e-3)
    ring = [run.state[layout_of(run.state).ring] for run in runs]
    assert ring[1] == pytest.approx(ring[0] / 2, rel=0.01)  # rounding of the equilibrium


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "scenes", "count"), [(0.001, None, 2), pytest.param(1.0, 4, 4, marks=pytest.mark.long_form)]
)
def test_a_few_judged_for_real(share: float, scenes: int | None, count: int) -> None:
    result = judge_runs(seed=5, share=share, scenes=scenes, jobs=2)
    assert result["counts"]["runs"] == len(result["runs"]) >= count
    assert result["counts"]["falsely_ok"] <= max(1, MOST_FALSE * len(result["runs"]))
    assert sum(row["runs"] for row in result["parts"] if row["part"] == "verdict") == len(result["runs"])
    assert all(run["errors"] for run in result["runs"] if run["status"] in USABLE), "each was compared"


def test_the_stored_runs_are_two_thousand_and_those_that_say_ok_are_right() -> None:
    path = Path(__file__).parents[2] / "reports" / "run_verdicts.json"
    stored: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    runs, counts = stored["runs"], stored["counts"]
    assert len(runs) == counts["runs"] == len([*fixed_cases(), *drawn_cases(stored["seed"])]) >= 2000
    for kind in ("falsely_ok", "falsely_failed"):
        wrong = [run for run in runs if run[kind]]
        assert len(wrong) == counts[kind]
        assert all(run["reason"] for run in wrong)
    for part in {entry["part"] for entry in stored["parts"]}:
        assert sum(entry["runs"] for entry in stored["parts"] if entry["part"] == part) == len(runs)
    assert counts["falsely_ok"] <= MOST_FALSE * counts["says_ok"]
    assert counts["falsely_failed"] == 0
