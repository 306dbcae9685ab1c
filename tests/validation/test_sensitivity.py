import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.scene import paper_scene
from srbval.validation import sensitivity
from srbval.validation.effects import ShapeEffect
from srbval.validation.sensitivity import BASE, UncertaintyTerm, terms
from srbval.validation.spectrum_shape import angle_between

STUDENT_RELATIVE = 1e-3  # Student's factor is printed with five digits


def line(value):
    return {"cage ratio": value}


def test_every_kind_of_term_that_a_validation_needs_is_in_the_table():
    listed = terms()
    named = " ".join(t.source for t in listed)
    for word in ("step", "n_pc", "ensemble", "geometry", "friction", "load", "speed", "defect height"):
        assert word in named or any(word in t.name for t in listed), word
    assert {t.kind for t in listed} == {"numerics", "input"}
    assert all(t.changes or t.geometry or t.relative_speed != 1 for t in listed)


def test_every_term_makes_a_scene_and_a_bearing(tmp_path):
    files = {t.name: sensitivity._bearing_file(t, tmp_path) for t in terms()}
    cases = list(sensitivity._cases(terms(), files, 1.0))
    assert len(cases) == 3 * (1 + len(terms()))
    changed = load_bearing(files["pitch radius half a printed digit off"])
    assert changed.geometry.pitch_radius_m == pytest.approx(141.815e-3)
    assert changed.geometry.raceway_radius_m == pytest.approx(164e-3)
    speeds = {c.scene.shaft_speed_rad_s for c in cases if c.state is Fault.OUTER}
    assert max(speeds) / min(speeds) == pytest.approx(1.001)


def test_points_are_doubled_at_the_same_stiffness():
    term = next(t for t in terms() if t.name == "twice the points")
    changed, base = paper_scene(**term.changes).contact, paper_scene().contact
    assert changed.points_per_circle == 2 * base.points_per_circle
    assert changed.stiffness_n_m * changed.points_per_circle == pytest.approx(
        base.stiffness_n_m * base.points_per_circle
    )
    assert changed.damping_ns_m * changed.points_per_circle == pytest.approx(base.damping_ns_m * base.points_per_circle)


def test_a_change_is_its_bound_and_repeats_give_one_interval():
    listed = (
        UncertaintyTerm(name="a", kind="input", source="s"),
        UncertaintyTerm(name="b", kind="numerics", source="s", ensemble="starts"),
        UncertaintyTerm(name="c", kind="numerics", source="s", ensemble="starts"),
    )
    found = {(n, Fault.OUTER): line(v) for n, v in ((BASE, 8.0), ("a", 7.9), ("b", 8.1), ("c", 7.9))}
    single, repeats = sensitivity._effects(listed, found, Fault.OUTER)
    assert (single.term, single.bound) == ("a", pytest.approx(0.1))
    assert single.bound_pct == pytest.approx(1.25)
    assert (repeats.term, repeats.bound) == ("starts", pytest.approx(4.3027 * 0.1, rel=STUDENT_RELATIVE))


def test_the_line_of_a_run_is_by_its_own_speeds():
    read = SimpleNamespace(found_hz=90.0, ci95_hz=0.1, depth=1.0, detected=True, kinematic_hz=90.0)
    analysis = SimpleNamespace(
        line_of=lambda _: read, lines=(), speed=SimpleNamespace(value_hz=10.0, ci95_hz=0.0),
        bearing=SimpleNamespace(rolling_elements=20),
    )  # fmt: skip
    assert sensitivity._values(SimpleNamespace(line_order=10.0, analysis=analysis), Fault.OUTER) == line(0.5)
    assert sensitivity._values(SimpleNamespace(line_order=None, analysis=analysis), Fault.OUTER) == line(0.45)


def test_what_a_term_does_to_the_shape_is_told_beside_a_record():
    """The bound is the change of the model's angle with that very record: a term that turns it away counts."""
    rng = np.random.default_rng(1)
    rig, other = rng.standard_normal((2, 120)), rng.standard_normal((2, 120))
    near, far = rig + 0.1 * other, rig + other
    effect = ShapeEffect(
        term="t", kind="input", source="s", defect="outer", base=near.tolist(), varied=far.tolist()
    )  # fmt: skip
    turned = angle_between(rig, far).degrees - angle_between(rig, near).degrees
    assert effect.bound_with(rig) == pytest.approx(turned)
    assert dataclasses.replace(effect, varied=effect.base).bound_with(rig) == 0
