"""Rates of the full model: time derivative and contact forces of one state, from Python."""

from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.models.full import columns as col
from srbval.models.full.forces_kernel import CIRCLES_PER_RACE
from srbval.models.full.motion_kernel import rates_and_loads
from srbval.models.full.parameters import Parameters


class Rates(NamedTuple):
    """Time derivative of a state, and the contact forces in this state.

    `rate` has the state's shape; `totals`, shape [col.TOTALS]: sums over all rollers, such as forces and powers;
    `load_n`, shape [2 races (outer, inner), rollers, 3]: normal forces [N] at three places along each roller.
    """

    rate: FloatArray
    totals: FloatArray
    load_n: FloatArray


def rates(model: Parameters, time_s: float, state: FloatArray) -> Rates:
    """Evaluate the equations of motion for one state at one time."""
    rate, totals = np.zeros_like(state), np.zeros(col.TOTALS)
    loads = np.zeros((2, len(model.slot_angle), CIRCLES_PER_RACE))
    rates_and_loads(time_s, state, model, rate, totals, loads)
    return Rates(rate=rate, totals=totals, load_n=loads)
