"""The outer ring alone on its housing rings at sqrt(K_h/m), damped by C_h.

Reason: mass, spring and damper of the housing set the model's lowest structural mode, near 1.2 kHz, inside the band in
which faults are read. Source: the damped oscillator; frequency and decay are read from the ring's displacement by
Prony's method (two poles from the ratio of consecutive samples), so they do not depend on where the ring starts. The
ring's mass is summed from slices in `world.py`.
"""

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.harness import (
    LOOSE_FIT,
    FloatArray,
    geometry,
    layout_of,
    paper_scene,
    parameters,
    rates,
    rolling_state,
    trajectory,
)
from tests.verification.world import World

STEP_S, STEPS_PER_SAMPLE, SAMPLES = 2e-6, 10, 200
# Fourth order: (7.4e3 rad/s * 2e-6 s)^4 / 120 per radian; and the mass by slices.
POLE = 1e-8


def poles(signal: FloatArray, interval_s: float) -> tuple[float, float]:
    """Angular frequency [rad/s] and decay rate [1/s] of x[k+2] = a x[k+1] - b x[k], least squares."""
    (a, b), *_ = np.linalg.lstsq(np.stack([signal[1:-1], -signal[:-2]], axis=1), signal[2:], rcond=None)
    decay = -np.log(b) / 2 / interval_s
    return float(np.arccos(a / 2 / np.sqrt(b)) / interval_s), float(decay)


@pytest.mark.parametrize("damping", ["0 Ns/m", "5e4 Ns/m", "5e5 Ns/m"])
def test_frequency_and_decay(damping: str) -> None:
    """In all three directions, about the place where the spring alone carries the load."""
    scene = paper_scene(
        contact=LOOSE_FIT, housing={"damping": damping}, load={"axial": "20 kN", "direction": "-50 deg"}
    )
    model, world = parameters(scene), World(scene, geometry())
    y = rolling_state(model)
    where = layout_of(y)
    y[where.ring] += (1e-6, -2e-6, 1.5e-6)
    y[where.ring_rate] = (0.01, 0.02, -0.005)
    ring = trajectory(model, y, step_s=STEP_S, steps=STEPS_PER_SAMPLE, outputs=SAMPLES)[:, where.ring]
    assert rates(model, 0.0, y).totals[col.DEEPEST] < 0, "nothing may touch"
    housing, mass = scene.housing, world.bodies.ring
    decay = housing.damping_ns_m / 2 / mass
    frequency = np.sqrt(housing.stiffness_n_m / mass - decay**2)
    rest = world.external_load(0.0) / housing.stiffness_n_m
    for axis in range(3):
        found = poles(ring[:, axis] - rest[axis], STEP_S * STEPS_PER_SAMPLE)
        assert found[0] == pytest.approx(frequency, rel=POLE)
        assert found[1] == pytest.approx(decay, abs=POLE * frequency)
