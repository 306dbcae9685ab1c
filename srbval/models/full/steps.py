"""Functions that call the full model's kernels from Python: rates of a state, and steps of a method."""

from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.models import outputs as out_col
from srbval.models.full import columns as col
from srbval.models.full.columns import layout_of
from srbval.models.full.forces_kernel import CIRCLES_PER_RACE
from srbval.models.full.motion_kernel import rates_and_loads
from srbval.models.full.parameters import Parameters
from srbval.models.full.step_kernel import ADVANCE, working_space
from srbval.models.outputs import Outputs
from srbval.models.solvers import Method


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


def take_steps(
    model: Parameters,
    state: FloatArray,
    method: Method,
    *,
    step_s: float,
    intervals: range,
    steps_per_output: int = 1,
    intervals_per_detail: int = 0,
    memory: FloatArray | None = None,
) -> Outputs:
    """Advance `state` in place over the output `intervals` of `steps_per_output` steps each.

    `intervals`: numbers of the intervals, counted from the start of the run; with an empty range, the kernel is only
    compiled. `memory`, of the state's shape: change of velocities that the leapfrog method predicts for the next step,
    updated in place; None at the start. Spins and contact loads are stored every `intervals_per_detail` intervals, 0
    for never.
    """
    memory = np.zeros_like(state) if memory is None else memory
    rollers, length = len(model.slot_angle), intervals_per_detail or max(len(intervals), 1)
    starts = intervals[::length]
    details = len(starts) if intervals_per_detail else 0
    out, spins = np.zeros((len(intervals), out_col.COLUMN_COUNT)), np.zeros((details, rollers))
    loads = np.zeros((details, 2, rollers, CIRCLES_PER_RACE))
    work = working_space(memory, len(method.b))
    model = model._replace(law=model.law._replace(onset_s=method.onset * step_s))
    for number, first in enumerate(starts or (intervals.start,)):
        step, rows = first * steps_per_output, out[number * length :][:length]
        if number < details:
            spins[number], loads[number] = state[layout_of(state).spin], rates(model, step * step_s, state).load_n
        ADVANCE[method.family](state, step, step_s, steps_per_output, method, model, work, rows)
    return Outputs(out=out, spin_rad_s=spins, load_n=loads)
