"""Each method converges at its own order on the contact problem, as long as no point comes or goes.

Reason: an integrator that is wired up wrongly still runs, at a lower order. Source: definition of the order; the
reference is the fourth-order method at a step 16 times finer than the finest tested. Loaded rollers under interference,
friction on its smooth slope, a shaft that hardly turns, and a swing of ring and rollers of some nanometres: the points
that touch stay the same, which is checked. What limits the order in a real run is shown too: at 710 rpm a point enters
or leaves contact every few microseconds, the contact damping jumps there, and the higher orders are lost.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.verification.harness import (
    PAPER_STEP_S,
    PRINTED_FIT,
    FloatArray,
    Layout,
    Parameters,
    Scene,
    advance,
    geometry,
    paper_scene,
    parameters,
    rolling_state,
)
from tests.verification.world import World

ORDERS = {"ode1": 1, "ode2": 2, "ode3": 3, "ode4": 4}
WINDOW_S = 4e-4
STEPS = {"ode1": (400, 800), "ode2": (100, 200), "ode3": (50, 100), "ode4": (100, 200)}
REFERENCE = 16
ORDER = 0.2  # the error's next term still counts at these steps; finer ones would meet rounding
EVENTFUL_ORDER = 2.0  # a jump of a force within a step costs one step times the jump: order one, with scatter
LEAST_TOUCHING = 300  # some four points per contact


def scene(shaft: str) -> Scene:
    contact = PRINTED_FIT | {"critical_velocity": "10 m/s"}
    return paper_scene(contact=contact, shaft_speed=shaft)


def settled(model: Parameters) -> FloatArray:
    y = rolling_state(model)
    advance(model, y, step_s=PAPER_STEP_S, steps=1200)
    return y


def errors(model: Parameters, start: FloatArray, method: str, steps: tuple[int, int]) -> list[float]:
    """Error of all velocities at the end of the window, each kind over its largest change, for each number of steps."""
    ends = {}
    for count, name in [(count, method) for count in steps] + [(max(steps) * REFERENCE, "ode4")]:
        y = start.copy()
        advance(model, y, step_s=WINDOW_S / count, steps=count, method=name)
        ends[count] = y
    exact = ends.pop(max(steps) * REFERENCE)
    where = Layout(start)
    parts = (where.slide_rate, where.spin, where.omega, where.ring_rate)
    return [
        float(np.hypot.reduce([np.linalg.norm(y[p] - exact[p]) / np.linalg.norm(exact[p] - start[p]) for p in parts]))
        for y in ends.values()
    ]


@pytest.mark.parametrize("method", ORDERS)
def test_order_without_contact_changes(method: str) -> None:
    case = scene("1e-6 rpm")
    model, world = parameters(case), World(case, geometry())
    y = settled(model)
    where = Layout(y)
    rng = np.random.default_rng(8)
    y[where.slide_rate] += rng.normal(0, 2e-4, where.count)
    y[where.spin] += rng.normal(0, 2e-2, where.count)
    y[where.ring_rate] += (1e-4, 2e-4, -1e-4)
    y[where.omega] += (1e-4, 1e-4, 1e-3)
    touching = world.contacts(0.0, y).touching
    coarse, fine = errors(model, y, method, STEPS[method])
    assert np.log2(coarse / fine) == pytest.approx(ORDERS[method], abs=ORDER)
    advance(model, y, step_s=WINDOW_S / 100, steps=100)
    assert world.contacts(WINDOW_S, y).touching == touching > LEAST_TOUCHING


@pytest.mark.parametrize("method", ["ode3", "ode4"])
def test_contact_changes_limit_the_order(method: str) -> None:
    """The error still falls with the step, but more slowly than even order two would have it."""
    model = parameters(scene("710 rpm"))
    y = settled(model)
    coarse, fine = errors(model, y, method, (25, 200))
    assert 0 < np.log2(coarse / fine) / 3 < EVENTFUL_ORDER
