"""An output rate no higher than the question needs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from srbval.plan.coarser_output import NAME, find_reductions, with_coarser_output
from srbval.plan.plan import Plan, make_plan
from srbval.plan.questions import Question
from srbval.scene import Scene, paper_scene

LINE_CHANGE_PCT = 1e-3  # the cage speed is a mean: averaging its samples by fours changes only how they are weighted
UNREACHABLE_PCT = 1e-9  # no two output rates give the same amplitude to eleven digits


def outer(model: str, **changes: object) -> Scene:
    return paper_scene(model=model, defect={"kind": "outer"}, **changes)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return make_plan(outer("full"), question=Question.LINES, tolerance_pct=0.5)


def test_it_is_taken_where_the_answer_stays(plan: Plan) -> None:
    scene = outer(plan.chosen)
    coarse, found = with_coarser_output(scene, plan)
    assert found.taken
    assert found.difference_pct is not None
    assert found.saves_pct is not None
    assert coarse == replace(scene, output_rate_hz=coarse.output_rate_hz)
    assert coarse.output_rate_hz == scene.output_rate_hz / 4
    assert coarse.solver == scene.solver


def test_the_model_s_own_error_must_leave_room_for_it(plan: Plan) -> None:
    chosen = next(c for c in plan.candidates if c.model == plan.chosen)
    tight = replace(plan, tolerance_pct=chosen.error_pct)  # type: ignore[arg-type]
    scene, found = with_coarser_output(outer(plan.chosen), tight)
    assert not found.taken
    assert "beyond 0 %" in found.why
    assert scene == outer(plan.chosen)


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"duration": "2 s"}, "not tried"), ({"detail_rate": "512 Hz"}, "detailed outputs"),
     ({"output_rate": "5120 Hz"}, "leave no room")],
)  # fmt: skip
def test_why_it_is_not_taken(plan: Plan, changes: dict[str, object], why: str) -> None:
    scene = outer(plan.chosen, **changes)
    same, found = with_coarser_output(scene, plan)
    assert (same, found.name, found.taken) == (scene, NAME, False)
    assert why in found.why


def test_nothing_is_reduced_where_the_model_s_error_is_unknown() -> None:
    scene = paper_scene(model="full", defect={"kind": "roller"})
    same, found = with_coarser_output(scene, make_plan(scene))
    assert (same, "not known" in found.why) == (scene, True)


@pytest.mark.parametrize(
    ("question", "tolerance_pct", "taken", "most_pct"),
    [(Question.LINES, 0.5, True, LINE_CHANGE_PCT), (Question.AMPLITUDE, UNREACHABLE_PCT, False, math.inf)],
)
def test_what_a_coarser_output_changes_of_the_full_model(
    question: Question, tolerance_pct: float, taken: bool, most_pct: float
) -> None:
    scene = paper_scene(defect={"kind": "outer"}, contact={"roller_fit": "printed"})
    (coarser,) = find_reductions(scene, question=question, tolerance_pct=tolerance_pct)
    assert (coarser.taken, coarser.name) == (taken, "output at 5120 Hz")
    assert coarser.difference_pct is not None
    assert coarser.difference_pct < most_pct
    assert taken == (coarser.difference_pct <= tolerance_pct) == ("within" in coarser.why)
