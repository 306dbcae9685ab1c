"""The draws of the cage ratio: what is run, that all records share it, and the stored result."""

from typing import Any

import pytest

from srbval.comparison.budget import FORMS, STATED
from srbval.errors import NumericsError
from srbval.models.run import RunStatus
from srbval.models.simulate import Step
from srbval.scene import Scene, changes_at, load_scene, rig_inputs, sobol, values_at
from srbval.storage.stored_result import newest_result
from srbval.studies.cage_draws import study
from srbval.studies.cage_draws.study import cage_ratio, finer, records, run_variant, variants

# Between the runs of two machines: rounding grows while contacts open and close, as between perturbed starts.
SAME_RATIO = 2e-6
OUTER, INNER = "line_contact.outer_osculation", "line_contact.inner_osculation"


class Ran:
    """A run that ended well, or did not."""

    def __init__(self, ratio: float, status: RunStatus = RunStatus.OK) -> None:
        self.cage_ratio, self.status, self.reason = ratio, status, "energy does not close"


def ran(monkeypatch: pytest.MonkeyPatch, found: Any) -> list[Scene]:
    """`found` in place of every run, and the scenes that were asked for."""
    scenes: list[Scene] = []

    def run(scene: Scene, *, step: Step) -> Ran:
        assert step is Step.UNCHECKED
        scenes.append(scene)
        return Ran(*found(scene))

    monkeypatch.setattr(study, "simulate", run)
    return scenes


def test_one_roller_has_one_profile_radius() -> None:
    """The inner osculation ends at the outer one's value, in every draw, and follows it when that is varied alone."""
    inputs = rig_inputs()
    drawn = [values_at(inputs, row) for row in sobol(len(inputs), 6)]
    assert all(0.96 <= one[INNER] <= one[OUTER] <= 0.985 for one in drawn)
    assert max(one[OUTER] - one[INNER] for one in drawn) > 0.01
    shares = [0.0 if one.key == OUTER else one.nominal_share for one in inputs]
    assert values_at(inputs, shares)[OUTER] == values_at(inputs, shares)[INNER] == 0.96
    nominal = changes_at(inputs, [one.nominal_share for one in inputs])
    assert load_scene("rig", nominal) == load_scene("rig")


@pytest.mark.parametrize("variant", list(variants()), ids=lambda one: f"{one.scene}, {one.form}")
def test_every_record_is_run_at_the_same_inputs(variant: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = ran(monkeypatch, lambda scene: (0.43 + 1e-9 * scene.shaft_speed_rad_s,))
    found = run_variant(variant, records(), power=2)
    of_each = 1 + 1 + sum(len(one.shares) for one in variant.inputs) + 4
    assert len(scenes) == of_each * len(records())
    assert {(one.defect.kind.value, round(60 * one.shaft_hz)) for one in scenes} >= {
        (one["state"], round(one["shaft_rpm"])) for one in records()
    }
    assert [effect["name"] for effect in found["effects"]] == [one.name for one in variant.inputs]
    assert [len(one["drawn"]) for one in found["records"]] == [len(found["at"])] * len(records())
    assert found["failed"] == 0


def test_other_forms_are_apart_from_what_the_paper_states() -> None:
    """Friction of an oil film begins where dry friction ends, and continuous contacts are no input."""
    by_form = {one.form: one for one in variants() if one.scene == "paper"}
    assert list(by_form) == [one.name for one in FORMS] == [STATED, "oil film", "continuous contacts"]
    dry, film = (
        next(one for one in by_form[form].inputs if one.name.startswith("critical velocity"))
        for form in (STATED, "oil film")
    )
    assert dry.value(1.0) == pytest.approx(film.value(0.0)) == pytest.approx(0.03)
    record = records()[0]
    models = [one.scene_at(record, [None] * len(one.inputs)).model for one in by_form.values()]
    assert models == ["full", "full", "slices"]


def test_a_failed_draw_is_left_out_of_all_records_and_a_failed_nominal_run_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = next(one for one in variants() if one.scene == "rig")
    slow = min(one["shaft_rpm"] for one in records())

    def breaks(scene: Scene, least_n: float) -> tuple[Any, ...]:
        bad = scene.load.radial_n > least_n and round(60 * scene.shaft_hz, 2) == slow
        return (0.43, RunStatus.ENERGY_OPEN if bad else RunStatus.OK)

    ran(monkeypatch, lambda scene: breaks(scene, 125e3))
    found = run_variant(rig, records(), power=4)
    assert 0 < len(found["at"]) < 16
    assert found["failed"] == 16 - len(found["at"]) + 1, "and the load's greatest value alone"
    assert {len(one["drawn"]) for one in found["records"]} == {len(found["at"])}
    ran(monkeypatch, lambda scene: breaks(scene, 0.0))
    with pytest.raises(NumericsError, match="nominal run of rig"):
        run_variant(rig, records(), power=1)


def test_a_finer_run_has_half_the_step_and_more_of_each_contact() -> None:
    for name in ("paper", "rig"):
        scene = load_scene(name)
        assert finer(scene).solver.step_s == scene.solver.step_s / 2
    assert finer(load_scene("paper")).contact.points_per_circle == 2 * load_scene("paper").contact.points_per_circle
    assert finer(load_scene("rig")).line_contact.slices > load_scene("rig").line_contact.slices


@pytest.fixture(scope="module")
def stored() -> dict[tuple[str, str], dict[str, Any]]:
    kept = newest_result("cage_draws")
    if kept is None:
        pytest.skip("no stored result; srbval study run cage_draws makes one")
    return {(one["scene"], one["form"]): one for one in kept.content["variants"]}


@pytest.mark.slow
def test_some_of_it_run_anew(stored: dict[tuple[str, str], dict[str, Any]]) -> None:
    for one in variants():
        kept = stored[one.scene, one.form]["records"][-1]
        assert cage_ratio(one.scene_at(kept, [None] * len(one.inputs))) == pytest.approx(
            kept["nominal"], abs=SAME_RATIO
        )
