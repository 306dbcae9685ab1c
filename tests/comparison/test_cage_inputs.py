"""What dimensions leave open of a cage ratio: the free contact angle, its limits, and which way each input moves it."""

import dataclasses
import math

import numpy as np
import pytest

from srbval.bearing import ElementShape, load_bearing
from srbval.comparison.cage_inputs import cage_inputs, free_contact_angle_rad, largest_clearance_m

BALLS = load_bearing("skf-6205").elements
assert BALLS is not None
# Dynaroll, "ball contact angle" (gobearings.com): groove radii of 0.56, ball [mm], radial play [um], angle [degrees].
TABLE = ((0.6, 5.08, 15.1), (1.5875, 7.62, 11.4), (1.5875, 16.51, 16.9), (3.175, 10.16, 9.4), (3.5719, 7.62, 7.6))


@pytest.mark.parametrize(("ball_mm", "play_um", "degrees"), TABLE)
def test_the_free_contact_angle_is_a_makers(ball_mm: float, play_um: float, degrees: float) -> None:
    angle = free_contact_angle_rad(np.array(play_um * 1e-6), np.array(1.12), np.array(ball_mm * 1e-3))
    assert math.degrees(float(angle)) == pytest.approx(degrees, abs=0.2)  # plays are rounded to 0.1 mil there


def test_an_angle_makes_the_cage_faster_and_slip_slower() -> None:
    """A ball at an angle rolls nearer to the axis of its spin: d cos(alpha) is what counts, so the cage gains."""
    rollers = dataclasses.replace(BALLS, shape=ElementShape.ROLLER)  # no angle: rounding, and slip that only lags
    assert cage_inputs(rollers).angle_deg == 0
    assert -0.0025 < cage_inputs(rollers).shift < -0.0005
    assert cage_inputs(BALLS).shift > cage_inputs(rollers).shift + 0.001
    assert cage_inputs(BALLS).ci95 > 1.5 * cage_inputs(rollers).ci95


def test_the_angle_reaches_that_of_the_largest_clearance() -> None:
    most = math.degrees(math.acos(1 - 28e-6 / (2 * 0.03 * BALLS.element_diameter_m)))
    assert most - 3 < cage_inputs(BALLS).angle_deg < most + 0.1


@pytest.mark.parametrize(("name", "bore_mm", "um"), [("skf-6205", 25, 28), ("fag-6203", 17, 25), ("nsk-6804", 20, 28)])
def test_the_clearance_is_that_of_the_bore(name: str, bore_mm: float, um: float) -> None:
    elements = load_bearing(name).elements
    assert elements.pitch_diameter_m - 1.75 * elements.element_diameter_m == pytest.approx(bore_mm * 1e-3, abs=1e-3)
    assert largest_clearance_m(elements) == pytest.approx(um * 1e-6)


def test_a_stated_angle_is_kept() -> None:
    angular = dataclasses.replace(BALLS, contact_angle_rad=math.radians(25))
    assert cage_inputs(angular).angle_deg == pytest.approx(25)
