"""One circle alone can roll without slip, and then the cage turns at a speed that geometry fixes.

Reason: the cage speed makes every fault frequency. The paper's three circles have different rolling radii and cannot
all roll; one alone can. Source: zero velocity of the roller's material at both contacts, in closed form below; nothing
of it depends on forces. A light interference presses all rollers alike, there is no load and no contact damping, so no
resistance is left that friction would have to overcome by slip.
"""

import math

import pytest
from scipy.optimize import brentq

from tests.verification.cases import subject
from tests.verification.harness import advance, geometry, layout_of, only_circle, rolling_state
from tests.verification.world import P, circle_profile

STEP_S, SETTLING_STEPS, STEPS = 1 / 245760, 6000, 3000
# Contacts are some 0.4 um deep, of an arm of 20 mm: their mean place is off by less than that share.
ROLLING = 5e-6
# Slow, so that the rollers' weight in the orbit does not lift them off the inner race; fine points, lightly damped.
CONTACT = {"radial_play": "-0.8 um", "points_per_circle": 20000, "critical_velocity": "0.5 mm/s"}
CONTACT |= {"stiffness": "1e7 N/m", "damping": "100 Ns/m"}
GENTLE = {"contact": CONTACT, "load": {"radial": "0 N"}, "shaft_speed": "71 rpm"}


def contact_places(p: float, slide: float) -> list[tuple[float, float, float]]:
    """Circle radius, and place of the contact along the slot and along the roller from its centre; outer, inner [m]."""
    g = geometry()
    c, s = math.cos(g.tilt_rad), math.sin(g.tilt_rad)
    circles = [circle_profile(g, race, p)[:2] for race in ("outer", "inner")]
    return [(r, r * c + height * s - g.pitch_radius_m / c - slide, height * c - r * s) for r, height in circles]


def resting_slide(p: float, roller_radius: float) -> float:
    """Slide at which a roller stands equally deep in both races' circle p; Table 1's rounding puts it off zero [m]."""
    profile = geometry().raceway_radius_m

    def difference(slide: float) -> float:
        outer, inner = (math.hypot(abs(a) + profile - roller_radius, h) for _, a, h in contact_places(p, slide))
        return outer - inner

    return float(brentq(difference, -1e-4, 1e-4))


def rolling_ratio(p: float, roller_radius: float) -> float:
    """Cage over shaft speed of pure rolling on circle p of both races.

    The roller turns at W sin(tilt) about its slot and at s about its own axis, its centre moves at W L cos(tilt). Its
    material at a along the slot and h along the roller moves at W L cos(tilt) + s a - W sin(tilt) h: zero at the outer
    race, the shaft's speed times the circle's radius at the inner.
    """
    g = geometry()
    c, s = math.cos(g.tilt_rad), math.sin(g.tilt_rad)
    slide = resting_slide(p, roller_radius)
    orbit = (g.pitch_radius_m / c + slide) * c
    (_, a_outer, h_outer), (r_inner, a_inner, h_inner) = contact_places(p, slide)
    spin = (s * h_outer - orbit) / a_outer
    return r_inner / (orbit + spin * a_inner - s * h_inner)


@pytest.mark.parametrize("circle", [1, 2, 3])
def test_cage_speed_of_pure_rolling(circle):
    whole, world = subject(GENTLE)
    model = only_circle(whole, circle)
    y = rolling_state(model)
    where = layout_of(y)
    advance(model, y, step_s=STEP_S, steps=SETTLING_STEPS)
    before = y.copy()
    advance(model, y, step_s=STEP_S, steps=STEPS)
    ratio = (y - before)[where.cage][2] / (STEP_S * STEPS) / world.scene.shaft_speed_rad_s
    assert ratio == pytest.approx(rolling_ratio(P[circle - 1], model.law.roller_radius), rel=ROLLING)
