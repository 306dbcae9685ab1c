"""Work of shaft and load = energy stored + energy lost over time.

Reason: the balance ties every force to the motion it drives; a force whose work is not accounted for, or a loss that is
none, breaks it. Source: first law; kinetic energy, weight and housing spring from `world.py`, not the model's account.
It closes with the step: powers are summed with the weights of the method itself, so what is left is the method's error.
Points that enter and leave contact within a step limit its order. At an instant it follows from
`test_equations_of_motion.py`: every speed obeys the forces, and powers and losses are theirs. The implicit methods
record torque and powers of the forces that they apply, friction and damping relaxed (`damping_kernel`): they close at
the paper's step, whatever the friction. Read at the velocities of the evaluation, the drive's power was 26 % too large
there.
"""

from typing import Any

import pytest

from srbval.models.full import columns as col
from tests.verification import harness
from tests.verification.cases import subject
from tests.verification.world import World

RUN_S = 4e-3
SMOOTH = {"critical_velocity": "0.5 m/s"}  # resolved by the paper's step
DEFECT = {"kind": "outer", "angle": "4 deg"}
# Scene, refinement of the paper's step, factor that it gains. Of order two four times the refinement gains 16, eight
# times 64; stiff friction and a critical velocity passed in a step spoil it (there imex2 leaves 1.7e-3 at the paper's
# step already).
RUNS: dict[str, tuple[dict[str, Any], int, float]] = {
    "interference": ({"contact": harness.PRINTED_FIT | SMOOTH}, 4, 10.0),
    "interference, outer-race defect": ({"contact": harness.PRINTED_FIT | SMOOTH, "defect": DEFECT}, 4, 10.0),
    "play, axial load, weight": ({"contact": SMOOTH, "load": {"axial": "20 kN", "gravity": True}}, 8, 30.0),
    "critical velocity of 1 mm/s": ({"contact": harness.PRINTED_FIT}, 16, 5.0),
}
LEFT_REFINED = 5e-4  # of the losses
# At the paper's step, with its friction: share of the losses left over, 0.023 with play at 3000 rpm, by imex1 0.039 at
# 710 rpm.
DEFAULT_S = 0.1
LEFT = {"imex2": 0.03, "imex1": 0.05}
AT_DEFAULT = [("imex2", {}, "outer", 127), ("imex2", {}, "inner", 3000), ("imex1", {}, "outer", 710)]
AT_DEFAULT += [("imex2", harness.PRINTED_FIT, "outer", 3000), ("imex2", harness.PRINTED_FIT, "inner", 127)]


def lost(totals: harness.FloatArray) -> float:
    """Power lost to friction, contact damping and housing damper [W]."""
    return float(totals[col.FRICTION_POWER] + totals[col.DAMPING_POWER] + totals[col.HOUSING_POWER])


def supplied(totals: harness.FloatArray) -> float:
    """Power of drive and load [W]."""
    return float(totals[col.DRIVE_POWER] + totals[col.LOAD_POWER])


def stored_energy(model: harness.Parameters, world: World, t: float, y: harness.FloatArray) -> float:
    """Sum the mechanical energy of the bodies, in world axes, and the elastic energy in the contacts [J]."""
    return world.mechanical_energy(y) + float(harness.rates(model, t, y).totals[col.CONTACT_ENERGY])


@pytest.mark.parametrize("name", RUNS)
def test_balance_over_time(name):
    changes, refinement, gain = RUNS[name]
    coarse, fine = (share_left(changes, "imex2", times) for times in (1, refinement))
    assert fine < LEFT_REFINED
    assert fine < coarse / gain


@pytest.mark.parametrize(("method", "contact", "kind", "rpm"), AT_DEFAULT)
def test_balance_at_the_default_step(method, contact, kind, rpm):
    changes = {"contact": contact, "defect": {"kind": kind}, "shaft_speed": f"{rpm} rpm"}
    assert share_left(changes, method, 1, DEFAULT_S) < LEFT[method]


def share_left(changes: dict[str, Any], method: str, refinement: int, run_s: float = RUN_S) -> float:
    """Energy unaccounted for as a share of all that was lost, over `run_s` from the rolling start."""
    model, world = subject(changes)
    y, step = harness.rolling_state(model), harness.PAPER_STEP_S / refinement
    steps, before = round(run_s / step), stored_energy(model, world, 0.0, y)
    (record,) = harness.advance(model, y, step_s=step, steps=steps, method=method)
    work, losses = (steps * step * float(record[columns].sum()) for columns in (harness.SUPPLIED, harness.LOST))
    return abs(stored_energy(model, world, steps * step, y) - before - work + losses) / losses
