"""The planner never names a rung that refuses the scene."""

from __future__ import annotations

from typing import Any

import pytest

import srbval
from srbval.models.simulate import Step
from srbval.plan.plan import make_plan
from srbval.plan.questions import Question


@pytest.mark.parametrize(
    ("changes", "chosen"),
    [
        ({"bearing": "skf-6205", "defect": {"kind": "outer"}}, "planar"),
        ({"bearing": "fag-nu2205", "defect": {"kind": "inner"}}, "planar"),
        ({"bearing": "fag-22205", "defect": {"kind": "inner"}}, "impulse"),
        ({"bearing": "skf-6205", "defect": {"kind": "outer", "shape": "flat", "extent": "0.4 mm"}}, "planar"),
    ],
)
def test_the_chosen_rung_runs_the_scene(changes: dict[str, Any], chosen: str) -> None:
    scene = srbval.paper_scene(duration="50 ms", **changes)
    plan = make_plan(scene, question=Question.LINES)
    assert plan.chosen == chosen
    assert {c.model for c in plan.candidates if "has no [geometry]" in c.why} >= {"line", "full"}
    run = srbval.simulate(srbval.paper_scene(duration="50 ms", model=plan.chosen, **changes), step=Step.UNCHECKED)
    assert run.status.usable


def test_what_every_rung_refuses_is_said() -> None:
    scene = srbval.paper_scene(bearing="skf-6205", defect={"kind": "outer"}, load={"axial": "1 kN"})
    plan = make_plan(scene)
    assert plan.chosen == "kinematic"  # it knows no load at all
    assert all("no axial motion" in c.why for c in plan.candidates if c.model in ("impulse", "planar"))
