"""What drives the model; the equations of motion are tested in `tests/verification`."""

import pytest

from srbval.models.full.motion_kernel import external_load, shaft_motion
from srbval.models.full.parameters import make_parameters
from srbval.scene import paper_scene
from tests.verification.harness import geometry


def test_the_shaft_follows_its_profile() -> None:
    """Trapezoids: the angle is the integral of the speed; the recorded time starts after settling."""
    scene = paper_scene(
        speed_profile={"time": ["0 s", "1 s", "3 s"], "speed": ["10 rad/s", "30 rad/s", "20 rad/s"]},
        duration="3 s",
        settle="0.5 s",
    )
    drive = make_parameters(scene, geometry()).drive
    assert shaft_motion(0.25, drive) == pytest.approx((10.0, 2.5))
    assert shaft_motion(1.0, drive) == pytest.approx((20.0, 5.0 + 7.5))
    assert shaft_motion(1.5, drive) == pytest.approx((30.0, 5.0 + 20.0))
    assert shaft_motion(3.5, drive) == pytest.approx((20.0, 5.0 + 20.0 + 50.0))
    assert scene.mean_shaft_rad_s == pytest.approx((20.0 + 50.0) / 3)


def test_the_load_follows_its_profile() -> None:
    scene = paper_scene(
        load_profile={"time": ["0 s", "2 s"], "radial": ["0 N", "100 kN"], "axial": ["10 kN", "0 N"]},
        duration="2 s",
        settle="0 s",
    )
    drive = make_parameters(scene, geometry()).drive
    assert external_load(0.5, drive) == pytest.approx((25e3, 7.5e3))
    assert external_load(9.0, drive) == pytest.approx((100e3, 0.0))
    assert scene.mean_radial_n == pytest.approx(50e3)
