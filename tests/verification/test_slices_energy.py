"""Slices: work = energy stored + energy lost, at an instant; shaft torque = rate of angular momentum.

Reason: a force whose work is not accounted for would heat or cool the run unseen. Source: first law and Newton's, with
kinetic energy and momenta of `world.py`; the energy in the contacts is the model's, whose slope the balance tests.
What is left is the mismatch of the polynomials for a slice's force and energy, and of the place where the force acts.
"""

from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.cases import subject
from tests.verification.harness import FloatArray, Parameters, Scene, layout_of, rates
from tests.verification.slices_reference import slices_model
from tests.verification.test_energy_balance import lost, supplied

RIG: dict[str, Any] = {
    "load": {"path": "bearing", "gravity": True},
    "shaft_speed": "858.94 rpm",
    "line_contact": {"traction": "lubricated"},
}
HOLE = {"kind": "outer", "shape": "hole", "extent": "2 mm", "height": "-0.5 mm", "axial": "0 mm"}
SPALL = {
    "kind": "inner",
    "shape": "flat",
    "extent": "6 mm",
    "width": "10 mm",
    "height": "-50 um",
    "axial": "-3 mm",
    "ramp": "1 mm",
}
PIT = HOLE | {"kind": "roller"}
CASES: dict[str, dict[str, Any]] = {
    "healthy": {},
    "radial and axial": {"load": {"axial": "20 kN"}},
    "dry": {"line_contact": {"traction": "dry"}, "contact": {"static_friction": 0.05, "dynamic_friction": 0.05}},
    "drilled outer race": {"defect": HOLE},
    "spall of the inner race": {"defect": SPALL},
    "drilled roller": {"defect": PIT},
}
SEEDS = (1, 2, 3)
OVER_RAD = 0.005  # a roller at the edge of the opening: 0.8 mm from its middle
SPAN_S = 1e-7
INSTANT = 1e-3  # of the largest power: the polynomials for a slice's force and energy
# The model turns a race's meridian to the roller's centre: a roller that the cage's tilt takes out of it meets the race
# beside its deepest place, by 2 um for 1e-4 rad, and what rolling moves that place by is not the force's work.
TILT_RAD, TILTED = 1e-4, 6e-3  # of the largest power
TORQUE = 1e-6  # of the largest torque: two difference quotients


def moving(scene: Scene, model: Parameters, seed: int, tilt_rad: float = 0.0) -> FloatArray:
    """A state in balance, then everything moved a little: rollers, cage, ring, and all their velocities."""
    y = equilibrium_state(model, cage_angle_rad=scene.load.zone_rad + OVER_RAD)
    rng, where = np.random.default_rng(seed), layout_of(y)
    y[where.slide] += rng.normal(0, 3e-6, where.rollers)
    y[where.rotation] = rng.normal(0, 0.04, where.rollers)
    y[where.cage] += [*rng.normal(0, 1.0, 2) * tilt_rad, 0.0]
    y[where.ring] += rng.normal(0, 5e-6, 3)
    y[where.slide_rate] += rng.normal(0, 0.02, where.rollers)
    y[where.spin] += rng.normal(0, 1.0, where.rollers)
    y[where.cage_rate] += rng.normal(0, [0.5, 0.5, 0.05])
    y[where.ring_rate] += rng.normal(0, 0.01, 3)
    return y


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("tilt_rad", "limit"), [(0.0, INSTANT), (TILT_RAD, TILTED)])
@pytest.mark.parametrize("name", CASES)
def test_balance_at_an_instant(name, tilt_rad, limit, seed):
    scene, model, world = subject(RIG, CASES[name], make=slices_model)
    y = moving(scene, model, seed, tilt_rad)
    found = rates(model, 0.0, y)

    def stored(ahead_s: float) -> float:
        ahead = y + ahead_s * found.rate
        return world.mechanical_energy(ahead) + float(rates(model, ahead_s, ahead).totals[col.CONTACT_ENERGY])

    change = (stored(SPAN_S) - stored(-SPAN_S)) / (2 * SPAN_S)
    largest = max(abs(supplied(found.totals)), lost(found.totals))
    assert change == pytest.approx(supplied(found.totals) - lost(found.totals), abs=limit * largest)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", CASES)
def test_torque_on_the_shaft_changes_the_momentum_of_cage_and_rollers(name, seed):
    """What the inner race's contacts give to cage and rollers is what they take from the shaft."""
    scene, model, world = subject(RIG, CASES[name], make=slices_model)
    y = moving(scene, model, seed, TILT_RAD)
    rows = model.slices.rows.copy()
    rows[1, :, col.SLICE_STIFFNESS] = 0.0
    without = model._replace(slices=model.slices._replace(rows=rows))

    def momentum_rate(own: Parameters) -> float:
        rate = rates(own, 0.0, y).rate
        ahead, behind = (world.momentum(y + side * SPAN_S * rate)[2] for side in (1, -1))
        return float(ahead - behind) / (2 * SPAN_S)

    torque = float(rates(model, 0.0, y).totals[col.SHAFT_TORQUE])
    assert abs(torque) > 1.0
    assert momentum_rate(model) - momentum_rate(without) == pytest.approx(-torque, rel=TORQUE, abs=TORQUE)
