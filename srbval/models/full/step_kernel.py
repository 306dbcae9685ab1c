"""Kernels: one step of the full model by each family of methods; runs of many steps, with means of their outputs.

Explicit Runge-Kutta methods, and methods that treat friction and contact damping implicitly, see `damping_kernel`.
Each family has its own kernel for runs, because a run compiles only the kernel that it uses.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.models import outputs as out_col
from srbval.models.full import columns as col
from srbval.models.full.columns import state_indices
from srbval.models.full.damping_kernel import BORDER, add_implicit_powers, factor, shaft_row, solve
from srbval.models.full.frames_kernel import cage_axes, cage_tilt, gimbal_rates, slot_axes, tilted_about_x
from srbval.models.full.motion_kernel import WITH_DAMPING, right_hand_side, shaft_motion
from srbval.models.full.second_cage_kernel import cage_of_row, cage_turns, relative_energy
from srbval.models.full.vectors_kernel import dot, entries_from, plus
from srbval.models.jit import inlined, kernel, kernel_part
from srbval.models.solvers import FAMILIES


class WorkingSpace(NamedTuple):
    """Arrays in which a step is computed, and sums over the steps of an output interval.

    Arrays of the state's size: `rates`, [stages, size], time derivative of each stage; `trial`, state of a stage or, in
    a leapfrog step, the change of speeds for `add_implicit_powers`; `deficit`, reduction of accelerations for
    `add_implicit_powers`; `ahead`, change of velocities that the last leapfrog step predicted for the next, zeros at
    the start. `factors`, [rows, 6]: from `damping_kernel.factor`. Totals are sums over all rollers, such as forces
    and powers, [col.TOTALS]: `totals` of the latest evaluation of the equations of motion; `mean`, sums of totals, see
    `add_to_mean`.
    """

    rates: FloatArray
    trial: FloatArray
    deficit: FloatArray
    factors: FloatArray
    totals: FloatArray
    mean: FloatArray
    ahead: FloatArray


def working_space(memory: FloatArray, stages: int) -> WorkingSpace:
    """Allocate the arrays of a method with `stages` stages; `memory`: array to use as `WorkingSpace.ahead`."""
    size = len(memory)
    return WorkingSpace(
        rates=np.zeros((max(2, stages), size)),
        trial=np.zeros(size),
        deficit=np.zeros(size),
        factors=np.zeros((col.FACTOR_ROWS, BORDER)),
        totals=np.zeros(col.TOTALS),
        mean=np.zeros(col.TOTALS),
        ahead=memory,
    )


@kernel_part
def add_to_mean(totals, weight, mean, first):
    """Add `weight` times the `totals` (forces, powers) of an evaluation to `mean`, their sums over an output interval.

    Two entries of `mean` are not sums: the largest of the deepest penetrations, and the contact energy at the start of
    the interval. At this start both entries must be -1. `first`: True for the first evaluation in a step.
    """
    for m in range(col.TOTALS):
        if m == col.DEEPEST:
            mean[m] = max(mean[m], totals[m])
        elif m == col.CONTACT_ENERGY:
            mean[m] = totals[m] if first and mean[m] < 0.0 else mean[m]
        else:
            mean[m] += weight * totals[m]


@inlined
def runge_kutta_step(y, t, step, method, model, work):
    """Advance state `y` from time `t` by `step` with a Runge-Kutta method; add forces and powers to `work.mean`."""
    size = y.shape[0]
    rates, trial, totals = work.rates, work.trial, work.totals
    a, b, c = method.a, method.b, method.c
    stages = b.shape[0]
    for s in range(stages):
        for m in range(size):
            trial[m] = y[m]
        for p in range(s):
            weight = step * a[s, p]
            if weight != 0.0:
                for m in range(size):
                    trial[m] += weight * rates[p, m]
        right_hand_side(t + c[s] * step, trial, model, rates[s], totals, None, None)
        add_to_mean(totals, b[s], work.mean, s == 0)
    for s in range(stages):
        weight = step * b[s]
        for m in range(size):
            y[m] += weight * rates[s, m]


@inlined
def leapfrog_step(y, t, step, method, model, work):
    """Advance state `y` from time `t` by `step` with a leapfrog `method`; add forces and powers to `work.mean`.

    Forces are linearised at predicted velocities: the velocities at the start of the step plus `work.ahead`, which is
    updated for the next step. Let x be the velocities minus the predicted velocities, so that x is -`work.ahead` at the
    start of the step. With the accelerations a at the predicted velocities and their derivative J with respect to the
    velocities (friction, damping), the step solves x' = a + J x. If a roller is damaged or wavy, all rollers turn half
    a step before the forces are evaluated and half a step at the end; otherwise no force depends on their angles, and
    they turn at the predicted velocities. Powers are corrected from the predicted velocities to those at which the mean
    force of the step acts, see `add_implicit_powers`.
    """
    size = y.shape[0]
    b, implicit, before, share = method.b, method.implicit_coefficient, method.c[0], method.ahead
    first, second = work.rates[0], work.rates[1]
    totals, factors, change, deficit, ahead = work.totals, work.factors, work.trial, work.deficit, work.ahead
    first_rate, end = np.uint64(size // 2), np.uint64(size)
    per = 1.0 / (implicit * step)
    damaged = model.roller_defects.shape[0] > 0 or model.surface.rollers.shape[1] > 0
    drift(y, before * step)
    if damaged:
        turn_rollers(y, 0.5 * step, model)
    for m in range(first_rate, end):
        y[m] += ahead[m]
    right_hand_side(t + before * step, y, model, first, totals, None, WITH_DAMPING)
    factor(implicit * step, model, totals, factors)
    shaft_row(model, factors)
    if not damaged:
        rollers = (first_rate - np.uint64(6)) // np.uint64(2)
        for m in range(rollers, np.uint64(2) * rollers):
            y[m] += step * first[m]
    # J x = (S x - x) / (gamma h), S = (1 - gamma h J)^-1, gamma the implicit coefficient
    for m in range(first_rate, end):
        deficit[m] = second[m] = first[m]
        first[m] -= ahead[m] * per
    solve(implicit * step, model, totals, factors, first)
    if b.shape[0] == 1:
        for m in range(first_rate, end):
            first[m] = b[0] * (first[m] + ahead[m] * per)
            change[m] = implicit * step * first[m] - ahead[m]
            deficit[m] -= first[m]
    else:
        for m in range(first_rate, end):
            first[m] += ahead[m] * per
            second[m] += (step * first[m] - ahead[m]) * per - 2.0 * first[m]
        solve(implicit * step, model, totals, factors, second)
        for m in range(first_rate, end):
            own = second[m] - (step * first[m] - ahead[m]) * per
            change[m] = 0.5 * step * ((1.0 + implicit) * first[m] + implicit * own) - ahead[m]
            first[m] = b[0] * first[m] + b[1] * own
            deficit[m] -= first[m]
    shaft, _ = shaft_motion(t + before * step, model.drive)
    add_implicit_powers(y, change, deficit, shaft, model, factors, totals)
    add_to_mean(totals, 1.0, work.mean, True)
    for m in range(first_rate, end):
        rise = step * first[m]
        y[m] += rise - ahead[m]
        ahead[m] = share * rise
    if damaged:
        turn_rollers(y, 0.5 * step, model)
    drift(y, (1.0 - before) * step)


@kernel_part
def drift(y, step):
    """Advance rollers' places in the cage, cage angles and ring by `step` [s] at the velocities in the state `y`."""
    at = state_indices(y.shape[0])
    for j in range(at.rotation):
        y[j] += step * y[at.slide_rate + j]
    c = at.cage
    omega = entries_from(y, at.cage_rate)
    rate_x, rate_y, _ = gimbal_rates(cage_tilt(y[c], y[c + 1]), omega)
    halfway = cage_tilt(y[c] + 0.5 * step * rate_x, y[c + 1] + 0.5 * step * rate_y)
    y[c], y[c + 1], y[c + 2] = plus(entries_from(y, c), step, gimbal_rates(halfway, omega))
    for m in range(3):
        y[at.ring + m] += step * y[at.ring_rate + m]
    for m in range(at.relative_angle, at.slide_rate):  # only with a second cage
        y[m] += step * y[at.slide_rate + m]


@kernel_part
def turn_rollers(y, step, model):
    """Advance the rollers' angles about their own axes by `step` [s] at the spins and cage speeds in the state `y`."""
    at = state_indices(y.shape[0])
    n, space = at.rotation, model.space
    turns = cage_turns(y, at, model.second_cage)
    w_x, w_y, w_z = y[at.cage_rate], y[at.cage_rate + 1], y[at.cage_rate + 2]
    tilt = cage_tilt(y[at.cage], y[at.cage + 1])
    # the cage's angular velocity in its own tilted axes, and the part of it along each roller's axis
    along, about_y = tilted_about_x(tilt, w_y, w_z)
    about_x = tilt.cos_y * w_x - tilt.sin_y * along
    along = model.tilt_cosine * (tilt.sin_y * w_x + tilt.cos_y * along)
    for row in range(2):
        ct, st, rate = cage_of_row(turns, 1.0 - 2.0 * row)
        p_c, p_s = model.tilt_sine * (ct * about_x + st * about_y), model.tilt_sine * (ct * about_y - st * about_x)
        along += model.tilt_cosine * rate
        own, speed = at.rotation + row * (n // 2), at.spin + row * (n // 2)
        for i in range(np.uint64(n // 2)):
            slot = np.uint64(2) * i + np.uint64(row)
            across = space[col.SLOT_COSINE + slot] * p_c + space[col.SLOT_SINE + slot] * p_s
            y[np.uint64(own) + i] += step * (y[np.uint64(speed) + i] - along + space[col.SIDE + slot] * across)


@partial(kernel_part, fastmath=False)  # the same rounding in every caller
def time_of_step(first_step, number, step):
    """Compute the time [s] at which step number `first_step` + `number` begins; bit-identical for all methods."""
    return (first_step + number) * step


def advance_with(name, take_step):
    """Make the kernel `name`, which advances the full model by `take_step`, a step of one family of solver methods."""

    def advance(y, first_step, step, steps_per_output, method, model, work, out):
        """Advance the state `y` in place by steps of `step` [s], the first of which is number `first_step` of the run.

        Fills `out`: a row for each output interval of `steps_per_output` steps, with the columns of `models.outputs`.
        `method`: `solvers.Method`; `model`: `Parameters`; `work`: `WorkingSpace`. Means in `out` weight a
        step's stages with `method.b`, so that the energy balance closes to the order of the method.
        """
        interval = step * steps_per_output
        for i in range(out.shape[0]):
            start = begin_interval(y, model, work.mean, out, i)
            for j in range(steps_per_output):
                t = time_of_step(first_step, i * steps_per_output + j, step)
                take_step(y, t, step, method, model, work)
            end_interval(y, start, interval, steps_per_output, work.mean, out, i)

    advance.__name__ = advance.__qualname__ = name  # of its machine code
    return kernel(advance)


@inlined
def begin_interval(y, model, mean, out, i):
    """Start an output interval: clear the sums in `mean`, write the present energies [J] to row `i` of `out`.

    Returns the ring's velocity, the angle of row 1's cage, and the angle by which a second cage is ahead of it,
    0 with one cage.
    """
    at = state_indices(y.shape[0])
    relative = 0.0
    for m in range(at.relative_angle, at.slide_rate):
        relative = y[m]
    for m in range(col.TOTALS):
        mean[m] = 0.0
    mean[col.DEEPEST] = mean[col.CONTACT_ENERGY] = -1.0  # see `add_to_mean`
    out[i, out_col.BODY_ENERGY_AT_START] = mechanical_energy(y, model)
    ring = entries_from(y, at.ring)
    out[i, out_col.SPRING_ENERGY_AT_START] = 0.5 * model.housing_stiffness * dot(ring, ring)
    return entries_from(y, at.ring_rate), y[at.cage + 2], relative


@inlined
def end_interval(y, start, interval, steps_per_output, mean, out, i):
    """Write means over an output interval of `interval` seconds, and the ring's position at its end, to `out` row `i`.

    `start`: result of `begin_interval`; `mean`: sums of forces and powers over the interval's `steps_per_output` steps.
    """
    at = state_indices(y.shape[0])
    velocity, turned, relative = start
    for m in range(3):
        out[i, out_col.ACCELERATION_X + m] = (y[at.ring_rate + m] - velocity[m]) / interval
        out[i, out_col.DISPLACEMENT_X + m] = y[at.ring + m]
        out[i, out_col.MEAN_RING_FORCE_X + m] = mean[col.RING_FORCE_X + m] / steps_per_output
        out[i, out_col.MEAN_ROLLING_POWER + m] = mean[col.ROLLING_POWER + m] / steps_per_output
    for m in range(at.relative_angle, at.slide_rate):  # the mean of two cages
        turned -= 0.5 * (y[m] - relative)
    out[i, out_col.CAGE_SPEED] = (y[at.cage + 2] - turned) / interval
    out[i, out_col.CAGE_TILT_X], out[i, out_col.CAGE_TILT_Y] = y[at.cage], y[at.cage + 1]
    out[i, out_col.MAX_PENETRATION] = mean[col.DEEPEST]
    for m in range(5):  # powers of drive and load; losses by friction, contact damping and the housing
        out[i, out_col.MEAN_DRIVE_POWER + m] = mean[col.DRIVE_POWER + m] / steps_per_output
    out[i, out_col.CONTACT_ENERGY_AT_START] = mean[col.CONTACT_ENERGY]


@kernel_part
def mechanical_energy(y, model):
    """Compute the kinetic and gravitational potential energy of rollers, cage and outer ring [J], without the shaft."""
    n = model.slot_angle.shape[0]
    at = state_indices(y.shape[0])
    turns = cage_turns(y, at, model.second_cage)
    omega, ring_velocity = entries_from(y, at.cage_rate), entries_from(y, at.ring_rate)
    axes = cage_axes(cage_tilt(y[at.cage], y[at.cage + 1]))
    along = dot(omega, axes[2])
    double = model.cage_transverse * dot(omega, omega) + (model.cage_axial - model.cage_transverse) * along * along
    double += model.ring_mass * dot(ring_velocity, ring_velocity)
    double += relative_energy(model.second_cage, turns.rate, along)
    height = model.ring_mass * y[at.ring + 1]
    space = model.space
    for j in range(n):
        slot = np.uint64(2 * j if j < n // 2 else 2 * j - n + 1)
        side = space[col.SIDE + slot]
        own_cosine, own_sine, rate = cage_of_row(turns, side)
        c = own_cosine * space[col.SLOT_COSINE + slot] - own_sine * space[col.SLOT_SINE + slot]
        s = own_sine * space[col.SLOT_COSINE + slot] + own_cosine * space[col.SLOT_SINE + slot]
        x, _, z = slot_axes(axes, c, s, model.tilt_cosine, side * model.tilt_sine)
        own = plus(omega, rate, axes[2])
        square = dot(own, own)
        reach = model.centre_distance + y[at.slide + j]
        across = square - dot(own, x) ** 2
        double += model.roller_mass * (y[at.slide_rate + j] ** 2 + reach * reach * across)
        double += model.roller_axial * y[at.spin + j] ** 2 + model.roller_transverse * (square - dot(own, z) ** 2)
        height += model.roller_mass * reach * x[1]
    return 0.5 * double - model.gravity * height


# Kernels of the families, in the order of `solvers.FAMILIES`.
ADVANCE = [
    advance_with(f"advance_{family}", step)
    for family, step in zip(FAMILIES, (runge_kutta_step, leapfrog_step), strict=True)
]
