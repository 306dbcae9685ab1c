from dataclasses import replace
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.errors import ConfigurationError
from srbval.models.simulate import Step, simulate
from srbval.plan import calibrated
from srbval.plan.calibrated import (
    calibration_of,
    corners,
    largest_error_pct,
    margins,
    neighbours,
    shipped_calibration,
)
from srbval.plan.plan import Candidate, Plan, make_plan
from srbval.plan.questions import Question, asked_of, pct_of
from srbval.plan.table import CalibrationTable
from srbval.scene import Scene, load_scene, paper_scene
from srbval.studies.calibration_runs import grid

CHEAPER = 100  # times: what Table 6 needs, against the full model
HALF = 0.5  # of the full model's cost: what makes the line model worth having


@pytest.fixture(scope="module")
def table() -> CalibrationTable:
    return shipped_calibration()


def paper(kind: str, **changes: object) -> Scene:
    return paper_scene(defect={"kind": kind}, **changes)


def candidate(plan: Plan, model: str) -> Candidate:
    return next(c for c in plan.candidates if c.model == model)


@pytest.mark.parametrize("kind", ["outer", "inner"])
def test_table6_needs_a_model_a_hundred_times_cheaper(kind: str) -> None:
    plan = make_plan(paper(kind), question=Question.LINES, tolerance_pct=0.5)
    walls = {c.model: c.wall_s for c in plan.candidates}
    assert plan.met
    assert walls["full"] / walls[plan.chosen] >= CHEAPER  # type: ignore[operator]


def test_inner_race_sidebands_are_refused_to_models_that_cannot_make_them() -> None:
    for tolerance in (0.5, 10.0, 1000.0):
        plan = make_plan(paper("inner"), question=Question.SIDEBANDS, tolerance_pct=tolerance)
        refused = candidate(plan, "kinematic")
        assert not refused.ok
        assert "load zone" in refused.why
        assert plan.chosen != "kinematic"


def test_a_tighter_tolerance_never_chooses_a_cheaper_model() -> None:
    for question in asked_of(Fault.OUTER):
        walls = []
        for tolerance in (1000.0, 100.0, 10.0, 1.0, 0.1, 0.01):
            plan = make_plan(paper("outer"), question=question, tolerance_pct=tolerance)
            walls.append(next(c.wall_s for c in plan.candidates if c.model == plan.chosen))
        assert walls == sorted(walls), question  # type: ignore[type-var]


def test_where_no_model_keeps_the_tolerance_that_is_said() -> None:
    plan = make_plan(paper("outer"), question=Question.NOISE_FLOOR, tolerance_pct=1e-6)
    assert (plan.chosen, plan.met) == ("full", False)
    assert "exceeds" in candidate(plan, "full").why


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"shaft_speed": "3000 rpm"}, "rpm"),
        ({"load": {"radial": "20 kN"}}, "radial"),
        ({"load": {"axial": "49 kN"}}, "axial"),
        ({"defect": {"kind": "outer", "height": "-0.5 mm"}}, "height"),
        ({"defect": {"kind": "roller"}}, "roller"),
        ({"contact": {"stiffness": "1e8 N/m"}}, "stiffness"),
        ({"solver": {"name": "ode1"}}, "ode1"),
        ({"duration": "0.5 s"}, "short"),
    ],
)
def test_a_scene_outside_what_was_measured_is_said_so_and_left_to_the_full_model(
    changes: dict[str, object], said: str
) -> None:
    plan = make_plan(paper_scene(**({"defect": {"kind": "outer"}} | changes)))
    assert plan.chosen == "full"
    assert any(said in reason for reason in plan.outside), plan.outside
    assert [c.model for c in plan.candidates if c.ok] == ["full"]


def test_predictions_between_the_calibration_scenes_are_the_worst_of_their_corners(table: CalibrationTable) -> None:
    scene = paper("outer", shaft_speed="500 rpm", load={"radial": "100 kN"})
    near = neighbours(table, scene)
    assert not near.outside
    assert {e.case.rpm for e in near.entries} == {353.0, 710.0}
    assert {e.case.radial_kn for e in near.entries} == {62.4, 124.8}
    errors = [e.levels["kinematic"].error_pct[Question.LINES] for e in near.entries]
    bound = max(errors) * margins(table)["play", "kinematic", Question.LINES].factor  # type: ignore[type-var, operator]
    assert near.error_pct("kinematic", Question.LINES) == bound
    for tolerance in (0.99 * bound, 1.01 * bound):
        plan = make_plan(scene, tolerance_pct=tolerance)
        assert plan.candidates[0].error_pct == bound
        assert plan.candidates[0].ok == (bound <= tolerance)


def test_each_scene_is_planned_by_the_table_about_its_own_base() -> None:
    for base, reference in (("paper", "full"), ("rig", "slices")):
        for case in grid(base):
            scene = case.scene(reference, seconds=10.0)
            assert calibration_of(scene).base == base
            (entry,) = neighbours(calibration_of(scene), scene).entries
            assert entry.case == case
    plan = make_plan(load_scene("rig", {"defect": {"kind": "outer"}}), question=Question.AMPLITUDE)
    assert plan.outside == ()
    assert "slices" in {c.model for c in plan.candidates}
    outside = make_plan(load_scene("rig", {"defect": {"kind": "outer"}, "load": {"axial": "20 kN"}}))
    assert (outside.chosen, len(outside.outside)) == ("slices", 1)


def test_the_line_model_costs_at_most_half_of_the_full_model(table: CalibrationTable) -> None:
    costs = [[e.levels[m].wall_per_simulated_s for m in ("line", "full")] for e in table.entries]
    assert sum(line for line, _ in costs) <= HALF * sum(full for _, full in costs)  # type: ignore[misc]


def test_the_least_model_for_an_amplitude_depends_on_the_amplitude() -> None:
    """About the rig's scene: a lower model's load zone makes the sidebands, none of its contacts makes the level."""
    scene, three = load_scene("rig", {"defect": {"kind": "inner"}}), pct_of(3.0)
    sidebands, octaves = (
        make_plan(scene, question=question, tolerance_pct=three)
        for question in (Question.SIDEBAND_LEVELS, Question.THIRD_OCTAVES)
    )
    assert sidebands.met
    assert octaves.met
    assert (sidebands.chosen, octaves.chosen) == ("impulse", "slices")
    assert "which is within 3 dB" in candidate(octaves, "slices").why
    unasked = make_plan(paper("inner"), question=Question.THIRD_OCTAVES, tolerance_pct=three)
    assert unasked.chosen == "full"
    assert any("not measured about the scene paper" in reason for reason in unasked.outside)
    assert "cannot answer: its clicks have no strength" in candidate(octaves, "kinematic").why


def test_questions_without_sense_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="no sidebands"):
        make_plan(paper("outer"), question=Question.SIDEBAND_LEVELS)
    with pytest.raises(ConfigurationError, match="no fault line"):
        make_plan(paper("none"), question=Question.HARMONICS)
    with pytest.raises(ConfigurationError, match="tolerance"):
        make_plan(paper("outer"), tolerance_pct=0.0)


def test_a_model_that_gave_no_answer_is_not_enough() -> None:
    plan = make_plan(paper("none"), question=Question.AMPLITUDE, tolerance_pct=1000.0)
    assert not candidate(plan, "impulse").ok


def test_settings_that_change_no_answer_are_no_reason(table: CalibrationTable) -> None:
    scene = replace(paper("outer"), seed=7, settle_s=0.1, duration_s=12.0)
    assert not neighbours(table, scene).outside


def test_a_margin_covers_what_was_seen_and_too_few_scenes_give_none(monkeypatch: pytest.MonkeyPatch) -> None:
    table = shipped_calibration()
    key = next(key for key, one in margins(table).items() if one.factor > 1)
    fit, model, question = key
    ratios = [
        entry.levels[model].error_pct[question] / predicted
        for entry in table.between
        if entry.case.fit == fit
        and entry.levels[model].error_pct.get(question) is not None
        and (predicted := largest_error_pct(corners(table.entries, entry.case), model, question))
    ]
    assert max(ratios) == margins(table)[key].factor
    monkeypatch.setattr(calibrated, "LEAST_SCENES", 1000)
    assert margins.__wrapped__(table) == {}


def test_power_is_answered_from_the_table_in_oil() -> None:
    plan = make_plan(load_scene("rig-oil"), question=Question.POWER, tolerance_pct=2.0)
    assert (plan.chosen, plan.met, plan.outside) == ("slices", True, ())
    assert candidate(plan, "slices").scenes == 16
    assert "knows no oil" in candidate(plan, "full").why
    assert not make_plan(load_scene("rig-oil"), question=Question.POWER, tolerance_pct=0.1).met


def test_free_rollers_lie_outside_the_tables_in_words() -> None:
    plan = make_plan(load_scene("rig-oil", {"bodies": {"free_rollers": True}}), question=Question.POWER)
    assert [reason for reason in plan.outside if "tilt and slide" in reason]
    held = make_plan(load_scene("rig", {"bodies": {"free_rollers": True}}), question=Question.SLIP)
    assert "holds its rollers" in candidate(held, "line").why


@pytest.mark.parametrize(
    ("changes", "chosen"),
    [
        ({"bearing": "skf-6205", "defect": {"kind": "outer"}}, "planar"),
        ({"bearing": "fag-nu2205", "defect": {"kind": "inner"}}, "planar"),
        ({"bearing": "fag-22205", "defect": {"kind": "inner"}}, "impulse"),
        ({"bearing": "skf-6205", "defect": {"kind": "outer", "shape": "flat", "extent": "0.4 mm"}}, "planar"),
    ],
)
def test_the_chosen_model_runs_the_scene(changes: dict[str, Any], chosen: str) -> None:
    scene = paper_scene(duration="50 ms", **changes)
    plan = make_plan(scene, question=Question.LINES)
    assert plan.chosen == chosen
    assert {c.model for c in plan.candidates if "has no [geometry]" in c.why} >= {"line", "full"}
    run = simulate(paper_scene(duration="50 ms", model=plan.chosen, **changes), step=Step.UNCHECKED)
    assert run.status.usable


def test_what_every_model_refuses_is_said() -> None:
    scene = paper_scene(bearing="skf-6205", defect={"kind": "outer"}, load={"axial": "1 kN"})
    plan = make_plan(scene)
    assert plan.chosen == "kinematic"  # it knows no load at all
    assert all("no axial motion" in c.why for c in plan.candidates if c.model in ("impulse", "planar"))
