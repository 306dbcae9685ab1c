"""One point hits one free roller: Kelvin and Voigt's spring and damper, released when the force would pull.

Reason: stiffness, damping, their signs and the release enter the rebound alone, without any other contact. Source:
Schwager & Pöschel, Coefficient of restitution and linear-dashpot model revisited, Granular Matter 9 (2007) 465: with
beta = c / 2m, w = sqrt(k/m - beta^2) the contact lasts (pi - atan(2 beta w / (w^2 - beta^2))) / w, and the bodies part
at exp(-beta t) of their speed. Smoothing is made so narrow that it does not matter. The point is the one point left of
the outer race; the roller moves along its slot, against a ring held fast or a free one of 90 kg.
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from tests.verification.harness import (
    FloatArray,
    Parameters,
    layout_of,
    only_circle,
    paper_scene,
    parameters,
    rolling_state,
    trajectory,
)

SPEED_M_S = 0.05
PLAY_M = 1e-4
STEP_S, STEPS_PER_STATE, STATES = 2e-7, 10, 220
HELD_KG = 1e15
# The point enters and leaves within a step, whose damping force is then wrong by C v for part of it: momentum
# C v h of m v, that is 1e3 Ns/m * 2e-7 s / 0.36 kg.
SPEED = 6e-4
TIME_S = STEP_S * STEPS_PER_STATE
ROUNDING_S = 2 * STEP_S  # the method's own choice of the step in which contact begins or ends
MOMENTUM = 1e-9  # forces on ring and roller are equal and opposite to rounding


@dataclass(frozen=True)
class Impact:
    """Depth of the point in roller 1, speeds of the roller and of the ring along the roller's slot, over time."""

    model: Parameters
    time: FloatArray
    depth: FloatArray
    slide_rate: FloatArray
    ring_rate: FloatArray

    @property
    def closing(self) -> FloatArray:
        return self.slide_rate - self.ring_rate


def impact(ring_kg: float | None, damping: str = "1e3 Ns/m") -> Impact:
    """Let roller 1 fly outwards at `SPEED_M_S` against the one point in its way."""
    scene = paper_scene(
        contact={"radial_play_m": PLAY_M, "smoothing_width": "1e-13 m", "points_per_circle": 60, "damping": damping},
        load={"radial": "0 N", "path": "bearing"},
        shaft_speed="1e-9 rpm",
    )
    model = only_circle(parameters(scene), 2)
    model = model._replace(ring_mass=ring_kg or model.ring_mass)
    y = rolling_state(model)
    where = layout_of(y)
    y[where.slide.start] = 0.9 * PLAY_M / 2
    y[where.slide_rate.start] = SPEED_M_S
    states = trajectory(model, y, step_s=STEP_S, steps=STEPS_PER_STATE, outputs=STATES)
    slot = np.array([model.tilt_cosine, 0.0, model.tilt_sine])  # the first roller stands on the x axis in row 1
    time: FloatArray = np.linspace(0.0, STATES * STEP_S * STEPS_PER_STATE, STATES + 1)
    ring_rate: FloatArray = states[:, where.ring_rate] @ slot
    gap = model.law.profile_radius - model.centre_distance - model.law.roller_radius
    depth: FloatArray = states[:, where.slide.start] - states[:, where.ring] @ slot - gap
    return Impact(model, time, depth, states[:, where.slide_rate.start], ring_rate)


def closed_form(mass: float, stiffness: float, damping: float) -> tuple[float, float]:
    """Duration of the contact [s] and speed after over speed before."""
    beta = damping / 2 / mass
    w = math.sqrt(stiffness / mass - beta**2)
    duration = (math.pi - math.atan2(2 * beta * w, w**2 - beta**2)) / w
    return duration, math.exp(-beta * duration)


@pytest.mark.parametrize("ring_kg", [HELD_KG, None], ids=["ring held fast", "free ring"])
@pytest.mark.parametrize("damping", [0.0, 1e3, 4e3])
def test_rebound(ring_kg: float | None, damping: float) -> None:
    found = impact(ring_kg, f"{damping} Ns/m")
    model = found.model
    mass = model.roller_mass * model.ring_mass / (model.roller_mass + model.ring_mass)
    duration, restitution = closed_form(mass, model.law.stiffness, damping)
    assert -found.closing[-1] == pytest.approx(restitution * SPEED_M_S, rel=SPEED)
    changing = np.flatnonzero(np.abs(np.diff(found.closing)) > 1e-9 * SPEED_M_S)
    seen = found.time[changing[-1] + 1] - found.time[changing[0]]
    assert -ROUNDING_S < seen - duration < 2 * TIME_S + ROUNDING_S, "between two kept states at either end"
    momentum = model.roller_mass * found.slide_rate + model.ring_mass * found.ring_rate
    if ring_kg is None:
        assert momentum == pytest.approx(model.roller_mass * SPEED_M_S, rel=MOMENTUM)


def test_depth_without_damping() -> None:
    """Half a sine: v sqrt(m / k) deep."""
    found = impact(HELD_KG, "0 Ns/m")
    depth = found.depth.max()
    expected = SPEED_M_S * math.sqrt(found.model.roller_mass / found.model.law.stiffness)
    missed_peak = (TIME_S / 2 * math.sqrt(found.model.law.stiffness / found.model.roller_mass)) ** 2 / 2
    assert depth == pytest.approx(expected, rel=2 * missed_peak)
