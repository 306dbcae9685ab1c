"""Wrong verdicts are found, of either kind; what is drawn is drawn anew."""

from __future__ import annotations

from dataclasses import replace

import pytest

from srbval.models.step_error import CAUTION, Estimate
from srbval.stability.own_verdicts import (
    MOST_FALSE,
    Condition,
    JudgedRun,
    drawn_conditions,
    fixed_conditions,
    judge_own_verdicts,
)

OFF = Estimate(kind="band_rms", of="RMS", error=0.3, scatter=0.05)
RIGHT = Estimate(kind="band_rms", of="RMS", error=0.1, scatter=0.05)  # 5 % and twice the chance of the comparison
RUN = JudgedRun(
    condition=Condition(scene="rig-outer", rpm=859.0), solver="imex2", step_s=1e-5, drawn=False, status="ok",
    reason="fine", errors=(RIGHT,), reference_status="ok",
)  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "falsely_ok", "falsely_failed"),
    [
        ({}, False, False),
        ({"errors": (OFF,)}, True, False),
        ({"errors": (OFF,), "reason": f"fine; {CAUTION}who knows"}, False, False),
        ({"errors": (OFF,), "status": "inaccurate"}, False, False),
        ({"status": "energy-open"}, False, True),
        ({"status": "energy-open", "errors": (OFF,)}, False, False),
        ({"status": "energy-open", "errors": ()}, False, False),
        ({"status": "energy-open", "reference_status": "energy-open"}, False, False),
        ({"status": "refused", "errors": ()}, False, False),
    ],
)
def test_wrong_verdicts(changes: dict[str, object], falsely_ok: bool, falsely_failed: bool) -> None:
    run = replace(RUN, **changes)  # type: ignore[arg-type]
    assert (run.falsely_ok, run.falsely_failed) == (falsely_ok, falsely_failed)


def test_two_thousand_runs_half_of_them_drawn() -> None:
    fixed, drawn = list(fixed_conditions()), list(drawn_conditions(1))
    assert len(fixed) + len(drawn) >= 2000
    assert len(drawn) == pytest.approx(len(fixed), rel=0.05)
    assert drawn == list(drawn_conditions(1)) != list(drawn_conditions(2))
    assert len(set(fixed)) == len(fixed)


def test_every_condition_is_a_scene() -> None:
    for condition, solver, times in drawn_conditions(3):
        scene = condition.at(solver, times)
        assert scene.solver.name == solver
        assert scene.load.radial_n == pytest.approx(condition.load * 124.8e3)
        assert condition.friction is None or scene.contact.static_friction == condition.friction


@pytest.mark.slow
def test_a_few_judged_for_real() -> None:
    result = judge_own_verdicts(seed=5, share=0.01, jobs=2)
    assert result.counts["runs"] == len(result.runs) >= 20
    assert result.counts["falsely_ok"] <= max(1, MOST_FALSE * len(result.runs))
    assert result.to_dict()["seed"] == 5
