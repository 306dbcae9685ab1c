"""Rollers of slices under load and rolling: loads against continuous integrals, cage speed against friction balances.

Reason: the distribution of load decides where rollers roll and how they strike a defect; the cage speed makes every
fault frequency, and a thousandth of it is what model and rig differ by. Source: `slices_reference.py`. Loads: integrals
along the roller with SciPy's root finding, without friction and gravity, at a shaft speed that presses no roller
outwards. Cage speed: two equations, moments of friction about a roller's axis and about the shaft are zero.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from srbval.models import outputs
from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.cases import subject
from tests.verification.harness import PAPER_STEP_S, FloatArray, Scene, advance, geometry, layout_of, rates
from tests.verification.slices_reference import STATIC, Contacts, Friction, SlicedBearing, balanced_ratio
from tests.verification.world import P, circle_profile

CASES: dict[str, dict[str, Any]] = {
    "radial": {},
    "radial, profiles of one radius": {"line_contact": {"outer_osculation": 1.0, "inner_osculation": 1.0}},
    "axial": {"load": {"radial": "0 N", "axial": "40 kN"}},
    "radial and axial": {"load": {"axial": "30 kN"}},
    "radial and axial, races of different osculation": {
        "load": {"axial": "20 kN"},
        "line_contact": {"outer_osculation": 0.985, "inner_osculation": 0.96},
    },
    # the contacts' middles lie beyond the rollers' ends: the standard's 30 slices and more for that
    "play, radial and axial, edges": {
        "load": {"axial": "49 kN", "direction": "-75 deg"},
        "contact": {"radial_play": "0.1 mm"},
        "line_contact": {"slices": 41},
    },
}
ROLLER = 0.02  # of a roller's load: one at the end of the load zone is pressed over two or three slices
SHARES = 0.03  # of a row's share of the load, of slices at the edges of a contact
RING, RING_M = 2e-3, 1e-8  # of the displacement: a tenth of `ROLLER`, of all loads together
NOTICED = 0.01  # of the largest load


@pytest.mark.parametrize("name", CASES)
def test_loads_and_displacement_are_those_of_the_integral(name):
    model, world = subject(STATIC, CASES[name])
    state = equilibrium_state(model)
    found = rates(model, 0.0, state).load_n.sum(axis=2)
    bearing = SlicedBearing.like(model, world.scene)
    ring, slide = bearing.balance(world.external_load(0.0))
    expected = bearing.contacts(slide, ring).force_n.sum(axis=2)
    least = NOTICED * float(expected.max())
    assert 5 <= (expected[0] > least).sum() < len(slide)
    assert found == pytest.approx(expected, rel=ROLLER, abs=ROLLER * least)
    rows = found.reshape(2, 2, -1).sum(axis=2)
    rows_expected = expected.reshape(2, 2, -1).sum(axis=2)
    whole = rows_expected.sum(axis=1, keepdims=True)
    assert rows / rows.sum(axis=1, keepdims=True) == pytest.approx(rows_expected / whole, rel=SHARES, abs=SHARES / 1e3)
    assert state[layout_of(state).ring] == pytest.approx(ring, rel=RING, abs=RING * np.abs(ring).max() + RING_M)


RUN = 2e-5  # of the ratio: a fiftieth of what model and rig differ by
RIG: dict[str, Any] = STATIC | {"contact": {}, "shaft_speed": "858.94 rpm"}
DRY = {"static_friction": 0.05, "dynamic_friction": 0.05, "critical_velocity": "1 mm/s"}
LINEAR = {"static_friction": 5.0, "dynamic_friction": 5.0, "critical_velocity": "10 m/s"}
OIL = {"traction": "lubricated", "traction_slope": 3.0, "traction_limit": 0.05}
RUNS = {"dry": {"contact": DRY}, "proportional to slip": {"contact": LINEAR}, "lubricated": {"line_contact": OIL}}
RUNS["lubricated, almost proportional"] = {"line_contact": OIL | {"traction_limit": 1.0}}
SETTLING_OUTPUTS, OUTPUTS, STEPS = 1, 2, 1024  # of the paper's step: 0.017 s and 0.033 s
CAGE_TURNS = np.arange(4) / 4 * 2 * np.pi / 19  # within a pitch of the rollers
PASSING = 1e-7  # by which the ratio differs from one interval to the next, twice that between 3 ms and 0.1 s
ROLLING_RATIO = 0.4307  # for the rollers' centrifugal force, 50 N of 15 kN, and the speed of rolling


def friction_of(scene: Scene) -> Friction:
    """The scene's law of friction at the speed of rolling."""
    if scene.line_contact.traction == "dry":
        return Friction(scene.contact.dynamic_friction, scene.contact.critical_velocity_m_s)
    races = [circle_profile(geometry(), race, P[1])[0] for race in ("outer", "inner")]
    rolling = scene.shaft_speed_rad_s * (races[0] * ROLLING_RATIO + races[1] * (1 - ROLLING_RATIO)) / 2
    limit = scene.line_contact.traction_limit
    return Friction(limit, limit / scene.line_contact.traction_slope * rolling)


@cache
def bearing_under_load(osculation: float) -> list[tuple[Contacts, FloatArray]]:
    """Contacts and slides at the rig's load and speed, at several cage angles: the same for every law of friction."""
    profiles = {"line_contact": {"outer_osculation": osculation, "inner_osculation": osculation}}
    model, world = subject(RIG, profiles)
    orbit = model.centre_distance * (ROLLING_RATIO * world.scene.shaft_speed_rad_s * model.tilt_cosine) ** 2
    bearing, found = replace(SlicedBearing.like(model, world.scene), swing_n=model.roller_mass * orbit), []
    for turn in CAGE_TURNS:
        turned = replace(bearing, angle_rad=bearing.angle_rad + turn)
        ring, slide = turned.balance(world.external_load(0.0))
        found.append((turned.contacts(slide, ring), slide))
    return found


@pytest.mark.parametrize(("name", "osculation"), [("dry", 1.0), *((name, 0.97) for name in RUNS)])
def test_a_run_turns_the_cage_as_the_balance_says(name, osculation):
    profiles = {"line_contact": {"outer_osculation": osculation, "inner_osculation": osculation}}
    model, world = subject(RIG, RUNS[name], profiles)
    y, shaft_rad_s = equilibrium_state(model), world.scene.shaft_speed_rad_s
    run = advance(model, y, step_s=PAPER_STEP_S, steps=STEPS, method="imex2", outputs=SETTLING_OUTPUTS + OUTPUTS)
    found = run[SETTLING_OUTPUTS:, outputs.CAGE_SPEED] / shaft_rad_s
    assert np.ptp(found) < PASSING
    expected = balanced_ratio(bearing_under_load(osculation), shaft_rad_s, friction_of(world.scene))
    assert found.mean() == pytest.approx(expected, abs=RUN)
