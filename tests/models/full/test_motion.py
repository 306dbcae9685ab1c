"""A bump all round a roller, and what drives the model; the equations of motion are tested in `tests/verification`."""

import numpy as np
import pytest

from srbval.models.full.motion_kernel import external_load, shaft_motion
from srbval.models.full.parameters import make_parameters
from srbval.models.full.steps import rates
from srbval.scene import paper_scene
from tests.verification.harness import geometry, rolling_state

WHOLE_POINTS = 0.02  # share of a point's extra force by which the roller's curvature changes it
UNCHANGED = 1e-6  # of the largest load: what leans from the slope of the bump on neighbouring circles


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
