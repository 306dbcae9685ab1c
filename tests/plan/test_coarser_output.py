"""An output rate no higher than the question needs."""

from __future__ import annotations

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
    assert same == scene
    assert "not known" in found.why


def test_a_coarser_output_keeps_the_lines_of_the_full_model() -> None:
    scene = paper_scene(contact={"roller_fit": "printed"})
    (coarser,) = find_reductions(scene, question=Question.LINES, tolerance_pct=0.5)
    assert (coarser.taken, coarser.name) == (True, "output at 5120 Hz")
    assert coarser.difference_pct is not None
    assert coarser.difference_pct < LINE_CHANGE_PCT


def test_what_changes_the_answer_too_much_is_not_taken() -> None:
    scene = paper_scene(defect={"kind": "outer"})
    (coarser,) = find_reductions(scene, question=Question.AMPLITUDE, tolerance_pct=UNREACHABLE_PCT)
    assert not coarser.taken
    assert coarser.difference_pct is not None
    assert coarser.difference_pct > UNREACHABLE_PCT
    assert "beyond" in coarser.why
