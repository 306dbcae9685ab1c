"""Work of shaft and load = energy stored + energy lost, at an instant and over time.

Reason: the balance ties every force to the motion it drives; a force whose work is not accounted for, or a loss that is
none, breaks it. Source: first law; kinetic energy, weight and housing spring from `world.py`, not the model's account.
At an instant the balance holds to rounding. Over time it closes with the step: powers are summed with the weights of
the method itself, so what is left is the method's error. Points that enter and leave contact within a step limit its
order. The implicit methods record torque and powers of the forces that they apply, friction and damping relaxed
(`power_kernel`): they close at the paper's step, whatever the friction. Read at the velocities of the evaluation, the
drive's power was 26 % too large there.
"""

from typing import Any

import pytest

from srbval.models.full import columns as col
from tests.verification.cases import CASES, make_case, subject
from tests.verification.harness import (
    DRIVE_AND_LOAD,
    LOST,
    PAPER_STEP_S,
    PRINTED_FIT,
    FloatArray,
    rates,
    recorded,
    rolling_state,
)

SPAN_S = 1e-9  # so short that no point comes or goes meanwhile
# The quotient loses 1e-14 of 60 J over 1e-9 s, a thousandth of a watt; the powers are 5 kW and more.
INSTANT = 3e-7
RUN_S = 4e-3
SMOOTH = {"critical_velocity": "0.5 m/s"}  # resolved by the paper's step
SCENES: dict[str, dict[str, Any]] = {
    "interference": {"contact": PRINTED_FIT | SMOOTH},
    "interference, outer-race defect": {"contact": PRINTED_FIT | SMOOTH, "defect": {"kind": "outer", "angle": "4 deg"}},
    "play, axial load, weight": {"contact": SMOOTH, "load": {"axial": "20 kN", "gravity": True}},
    "critical velocity of 1 mm/s": {"contact": PRINTED_FIT},
}
# Refinements of the paper's step, share of the losses left at the last, factor gained from first to last. Of order two
# four times the refinement gains 16, eight times 64; stiff friction and a critical velocity passed in a step spoil it
# (there imex2 leaves 1.7e-3 at the paper's step already).
RUNS: dict[str, tuple[tuple[int, int], float, float]] = {
    "interference": ((1, 4), 5e-4, 10.0),
    "interference, outer-race defect": ((1, 4), 5e-4, 10.0),
    "play, axial load, weight": ((1, 8), 5e-4, 30.0),
    "critical velocity of 1 mm/s": ((1, 16), 5e-4, 5.0),
}
# At the paper's step, with its friction: share of the losses left over, 0.023 with play at 3000 rpm, by imex1 0.039 at
# 710 rpm.
DEFAULT_S = 0.1
LEFT = {"imex2": 0.03, "imex1": 0.05, "ros2": 0.05}
AT_DEFAULT = [
    ("imex2", {}, "outer", 127),
    ("imex2", {}, "inner", 3000),
    ("imex2", PRINTED_FIT, "outer", 3000),
    ("imex2", PRINTED_FIT, "inner", 127),
    ("imex1", {}, "outer", 710),
    ("ros2", PRINTED_FIT, "outer", 710),
]


def lost(totals: FloatArray) -> float:
    """Power lost to friction, contact damping and housing damper [W]."""
    return float(totals[col.FRICTION_POWER] + totals[col.DAMPING_POWER] + totals[col.HOUSING_POWER])


def supplied(totals: FloatArray) -> float:
    """Power of drive and load [W]."""
    return float(totals[col.DRIVE_POWER] + totals[col.LOAD_POWER])


@pytest.mark.parametrize("name", CASES)
def test_balance_at_an_instant(name):
    case = make_case(name)

    def stored(ahead_s: float) -> float:
        y = case.y + ahead_s * case.found.rate
        return case.world.mechanical_energy(y) + case.world.contacts(case.time + ahead_s, y).stored

    change = (stored(SPAN_S) - stored(-SPAN_S)) / (2 * SPAN_S)
    contact = case.found.totals
    largest = max(abs(supplied(contact)), lost(contact))
    assert change == pytest.approx(supplied(contact) - lost(contact), abs=INSTANT * largest)


@pytest.mark.parametrize("name", SCENES)
def test_balance_over_time(name):
    (coarse, fine), share, gain = RUNS[name]
    left = {refinement: share_left(SCENES[name], "imex2", refinement) for refinement in (coarse, fine)}
    assert left[fine] < share
    assert left[fine] < left[coarse] / gain


@pytest.mark.parametrize(("method", "contact", "kind", "rpm"), AT_DEFAULT)
def test_balance_at_the_default_step(method, contact, kind, rpm):
    changes = {"contact": contact, "defect": {"kind": kind}, "shaft_speed": f"{rpm} rpm"}
    assert share_left(changes, method, 1, DEFAULT_S) < LEFT[method]


def share_left(changes: dict[str, Any], method: str, refinement: int, run_s: float = RUN_S) -> float:
    """Energy unaccounted for as a share of all that was lost, over `run_s` from the rolling start."""
    _, model, world = subject(changes)
    y, step = rolling_state(model), PAPER_STEP_S / refinement
    before = world.mechanical_energy(y) + rates(model, 0.0, y).totals[col.CONTACT_ENERGY]
    steps = round(run_s / step)
    seconds = steps * step
    (record,) = recorded(model, y, step_s=step, steps=steps, method=method)
    work, losses = seconds * float(record[DRIVE_AND_LOAD].sum()), seconds * float(record[LOST].sum())
    after = world.mechanical_energy(y) + rates(model, seconds, y).totals[col.CONTACT_ENERGY]
    return float(abs(after - before - work + losses) / losses)
