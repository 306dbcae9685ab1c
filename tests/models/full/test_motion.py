"""The right-hand side in the scenes that `tests/verification` does not take up, and what drives it.

The independent formulation is that of `tests/verification/world.py`; orders of the methods, conservation laws and
compiled against plain Python stand there too.
"""

from __future__ import annotations

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.motion_kernel import external_load, shaft_motion
from srbval.models.full.parameters import make_parameters
from srbval.models.full.state import layout_of
from srbval.models.full.steps import rates, take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.verification.harness import geometry, rolling_state
from tests.verification.world import GRAVITY, World

ROUNDING = 1e-9  # of two formulations that subtract lengths of 0.16 m to find micrometres of penetration
GROWN_ROUNDING = 1e-8  # the same for the net force of a run's state, in which forces on the ring nearly cancel
WHOLE_POINTS = 0.02  # share of a point's extra force by which the roller's curvature changes it
UNCHANGED = 1e-6  # of the largest load: what leans from the slope of the bump on neighbouring circles


def test_evaluating_only_near_rollers_loses_nothing() -> None:
    """Rollers that are passed over as too far from a race carry no force in the independent formulation."""
    scene = paper_scene()
    model = make_parameters(scene, geometry())
    y = rolling_state(model)
    take_steps(model, y, METHODS["ode4"], step_s=scene.solver.step_s, intervals=1800)
    t = 1800 * scene.solver.step_s
    expected = World(scene, geometry()).contacts(t, y).on_ring
    found = rates(model, t, y).totals[col.RING_FORCE]
    assert found == pytest.approx(expected, abs=GROWN_ROUNDING * float(np.linalg.norm(expected)))


def test_a_bump_on_a_roller_presses_like_a_thicker_roller() -> None:
    """A bump all round one roller at its middle circle adds its height to the penetration there, and nowhere else."""
    height = 1e-5
    bump = {"kind": "roller", "height": "0.01 mm", "extent": "0.05 m", "roller": 4, "row": 2, "angle": "0 deg"}
    scene = paper_scene(contact={"roller_fit": "printed"})
    g = geometry()
    plain = make_parameters(scene, g)
    y = rolling_state(plain)
    third = bump | {"extent": "0.0418 m"}
    ringed = make_parameters(
        paper_scene(
            contact={"roller_fit": "printed"},
            defect=third,
            further_defects=[third | {"angle": "120 deg"}, third | {"angle": "240 deg"}],
        ),
        g,
    )
    before, after = rates(plain, 0.0, y).load_n, rates(ringed, 0.0, y).load_n
    changed = np.argwhere(np.abs(after - before) > UNCHANGED * before.max())
    assert {tuple(c) for c in changed} <= {(0, 22, 1), (1, 22, 1)}, "roller 4 of row 2, middle circle, both races"
    touching = after[:, 22, 1] > 0
    assert touching.any()
    # each touching point is pressed deeper by the height; one or two points touch
    extra = (after - before)[:, 22, 1] / (plain.law.stiffness * height)
    assert np.all(np.isclose(extra[touching], np.round(extra[touching]), atol=WHOLE_POINTS))


def test_the_shaft_follows_its_profile() -> None:
    """Trapezoids: the angle is the integral of the speed; the recorded time starts after settling."""
    scene = paper_scene(
        speed_profile={"time": ["0 s", "1 s", "3 s"], "speed": ["10 rad/s", "30 rad/s", "20 rad/s"]},
        duration="3 s", settle="0.5 s",
    )  # fmt: skip
    drive = make_parameters(scene, geometry()).drive
    assert shaft_motion(0.25, drive) == pytest.approx((10.0, 2.5))
    assert shaft_motion(1.0, drive) == pytest.approx((20.0, 5.0 + 7.5))
    assert shaft_motion(1.5, drive) == pytest.approx((30.0, 5.0 + 20.0))
    assert shaft_motion(3.5, drive) == pytest.approx((20.0, 5.0 + 20.0 + 50.0))
    assert scene.mean_shaft_rad_s == pytest.approx((20.0 + 50.0) / 3)


def test_the_load_follows_its_profile() -> None:
    scene = paper_scene(
        load_profile={"time": ["0 s", "2 s"], "radial": ["0 N", "100 kN"], "axial": ["10 kN", "0 N"]},
        duration="2 s", settle="0 s",
    )  # fmt: skip
    drive = make_parameters(scene, geometry()).drive
    assert external_load(0.5, drive) == pytest.approx((25e3, 7.5e3))
    assert external_load(9.0, drive) == pytest.approx((100e3, 0.0))
    assert scene.mean_radial_n == pytest.approx(50e3)


def test_gravity_pulls_down_on_everything() -> None:
    """Free flight: every slide and the ring fall with the component of g along their direction."""
    free = {"contact": {"radial_play": "3 mm"}, "load": {"radial": "0 N"}}
    scene = paper_scene(**free | {"load": {"gravity": True, "radial": "0 N"}})
    model, without = (make_parameters(s, geometry()) for s in (scene, paper_scene(**free)))
    y = rolling_state(without)
    layout = layout_of(y)
    difference = rates(model, 0.0, y).rate - rates(without, 0.0, y).rate
    assert difference[layout.ring_rate] == pytest.approx([0.0, -GRAVITY, 0.0])
    up = World(scene, geometry()).slots(y)[:, 1, 0]
    assert difference[layout.slide_rate] == pytest.approx(-GRAVITY * up, abs=ROUNDING)
