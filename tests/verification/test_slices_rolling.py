"""Where rollers roll: the balance of friction on each roller and about the shaft, against runs.

Reason: the cage speed makes every fault frequency, and a thousandth of it is what model and rig differ by. Source: two
equations, moments of friction about a roller's axis and about the shaft are zero, solved in `slices_reference.py` with
loads of its own. Tolerances are of the ratio of cage and shaft speed.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.steps import take_steps
from srbval.models.solvers import METHODS
from tests.verification.harness import (
    PAPER_STEP_S,
    FloatArray,
    Parameters,
    Scene,
    geometry,
    layout_of,
    merged,
    paper_scene,
)
from tests.verification.slices_reference import (
    Contacts,
    Friction,
    SlicedBearing,
    balanced_ratio,
    loads_of_slices,
    slices_model,
)
from tests.verification.world import P, circle_profile

RUN = 2e-5  # of the ratio: a fiftieth of what model and rig differ by
RIG: dict[str, Any] = {"load": {"path": "bearing"}, "shaft_speed": "858.94 rpm"}
DRY = {"static_friction": 0.05, "dynamic_friction": 0.05, "critical_velocity": "1 mm/s"}
LINEAR = {"static_friction": 5.0, "dynamic_friction": 5.0, "critical_velocity": "10 m/s"}
OIL = {"traction": "lubricated", "traction_slope": 3.0, "traction_limit": 0.05}
RUNS: dict[str, dict[str, Any]] = {
    "dry": {"contact": DRY},
    "proportional to slip": {"contact": LINEAR},
    "lubricated": {"line_contact": OIL},
    "lubricated, almost proportional": {"line_contact": OIL | {"traction_limit": 1.0}},
}
SETTLING_OUTPUTS, OUTPUTS, STEPS = 1, 2, 1024  # of the paper's step: 0.017 s and 0.033 s
CAGE_TURNS = np.arange(4) / 4 * 2 * np.pi / 19  # within a pitch of the rollers
PASSING = 1e-7  # by which the ratio differs from one interval to the next, twice that between 3 ms and 0.1 s
ROLLING_RATIO = 0.4307  # for the rollers' centrifugal force, 50 N of 15 kN, and the speed of rolling
CIRCLES = 1e-4  # circles under load do not carry the same


def ratio_of_run(scene: Scene, model: Parameters) -> FloatArray:
    """Cage over shaft speed in each output interval after settling."""
    y = equilibrium_state(model)
    memory, turned = np.zeros_like(y), []
    for i in range(SETTLING_OUTPUTS + OUTPUTS):
        take_steps(
            model,
            y,
            METHODS["imex2"],
            step_s=PAPER_STEP_S,
            intervals=range(i, i + 1),
            steps_per_output=STEPS,
            memory=memory,
        )
        turned.append(y[layout_of(y).cage][2])
    return np.diff(turned[SETTLING_OUTPUTS - 1 :]) / (STEPS * PAPER_STEP_S * scene.shaft_speed_rad_s)


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
    """The rig's bearing at its load and speed, at several cage angles: the same for every law of friction."""
    profiles = {"line_contact": {"outer_osculation": osculation, "inner_osculation": osculation}}
    scene = paper_scene(**merged(RIG, profiles))
    model = slices_model(scene)
    orbit = model.centre_distance * (ROLLING_RATIO * scene.shaft_speed_rad_s * model.tilt_cosine) ** 2
    bearing = replace(SlicedBearing.like(model, scene), swing_n=model.roller_mass * orbit)
    return bearing.at_cage_angles(np.array([0.0, -scene.load.radial_n, 0.0]), CAGE_TURNS)


@pytest.mark.parametrize(("name", "osculation"), [("dry", 1.0), *((name, 0.97) for name in RUNS)])
def test_a_run_turns_the_cage_as_the_balance_says(name: str, osculation: float) -> None:
    profiles = {"line_contact": {"outer_osculation": osculation, "inner_osculation": osculation}}
    scene = paper_scene(**merged(RIG, RUNS[name], profiles))
    found = ratio_of_run(scene, slices_model(scene))
    assert np.ptp(found) < PASSING
    expected = balanced_ratio(bearing_under_load(osculation), scene.shaft_speed_rad_s, friction_of(scene))
    assert found.mean() == pytest.approx(expected, abs=RUN)


@pytest.mark.parametrize(("kind", "published"), [("dry", 0.43150), ("proportional to slip", 0.43199)])
def test_three_slices_where_the_paper_has_its_circles(kind: str, published: float) -> None:
    """The paper's three circles as narrow slices of equal stiffness, with the loads that they then carry."""
    profiles = {"line_contact": {"slices": 3, "outer_osculation": 1.0, "inner_osculation": 1.0}}
    scene = paper_scene(**merged(RIG, RUNS[kind], profiles))
    model = slices_model(scene)
    rows = model.slices.rows.copy()
    places = np.array([[circle_profile(geometry(), race, p) for p in P] for race in ("outer", "inner")])
    rows[:, 0, [col.SLICE_RADIAL, col.SLICE_AXIAL, col.SLICE_NORMAL_RADIAL, col.SLICE_NORMAL_AXIAL]] = np.moveaxis(
        places, 2, 1
    )
    rows[:, 0, col.SLICE_WIDTH], rows[:, 0, col.SLICE_VERTEX] = 1e-6, 1e-8
    rows[:, 0, [col.SLICE_LIFT, col.SLICE_BEND]] = 0.0
    rows[:, 0, col.SLICE_STIFFNESS] = rows[:, 0, col.SLICE_STIFFNESS].mean()
    model = model._replace(slices=model.slices._replace(rows=rows))
    found = float(ratio_of_run(scene, model).mean())
    y = equilibrium_state(model)
    slide, c, s = y[layout_of(y).slide], model.tilt_cosine, model.tilt_sine
    radial, axial = places[:, None, :, 0], places[:, None, :, 1]
    ring = SlicedBearing.like(model, scene).slot_and_axis(y[layout_of(y).ring])
    moved_s, moved_x = (np.stack([own, np.zeros_like(own)])[:, :, None] for own in ring)
    contacts = Contacts(
        force_n=loads_of_slices(model, y),
        x_m=axial * c - radial * s + moved_x,
        normal_s=np.zeros(0),
        s_m=radial * c + axial * s + moved_s - (model.centre_distance + slide)[:, None],
        normal_x=np.zeros(0),
    )
    expected = balanced_ratio([(contacts, slide)], scene.shaft_speed_rad_s, friction_of(scene), between=0.0)
    assert found == pytest.approx(expected, abs=RUN)
    assert found == pytest.approx(published, abs=CIRCLES)
