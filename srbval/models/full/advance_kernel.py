"""Kernels (compiled functions): advance the full model in time, and average its outputs over each output interval.

Each family of solver methods has its own kernel, because a run compiles only the kernel that it uses.
"""

from functools import partial

import numpy as np

from srbval.models import outputs as out_col
from srbval.models.full import columns as col
from srbval.models.full.columns import state_indices
from srbval.models.full.frames_kernel import cage_axes, cage_tilt, slot_axes
from srbval.models.full.second_cage_kernel import cage_of_row, cage_turns, relative_energy
from srbval.models.full.step_kernel import leapfrog_step, rosenbrock_step, runge_kutta_step
from srbval.models.jit import inlined, kernel, kernel_part
from srbval.models.solvers import FAMILIES


@partial(kernel_part, fastmath=False)  # the same rounding in every caller
def time_of_step(first_step, number, step):
    """Compute the time [s] at which step number `first_step` + `number` begins; bit-identical for all methods."""
    return (first_step + number) * step


def advance_with(name, take_step):
    """Make the kernel `name`, which advances the full model by `take_step`, a step of one family of solver methods."""

    def advance(y, first_step, step, steps_per_output, method, model, work, out):
        """Advance the state `y` in place by steps of `step` [s], the first of which is number `first_step` of the run.

        Fills `out`: a row for each output interval of `steps_per_output` steps, with the columns of `models.outputs`.
        `method`: `solvers.Coefficients`; `model`: `Parameters`; `work`: `WorkingSpace`. Means in `out` weight a
        step's stages with `method.powers`, so that the energy balance closes to the order of the method.
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

    Returns the ring's velocity x, y, z, the angle of row 1's cage, and the angle by which a second cage is ahead of it,
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
    spring = y[at.ring] ** 2 + y[at.ring + 1] ** 2 + y[at.ring + 2] ** 2
    out[i, out_col.SPRING_ENERGY_AT_START] = 0.5 * model.housing_stiffness * spring
    v = at.ring_rate
    return y[v], y[v + 1], y[v + 2], y[at.cage + 2], relative


@inlined
def end_interval(y, start, interval, steps_per_output, mean, out, i):
    """Write means over an output interval of `interval` seconds, and the ring's position at its end, to `out` row `i`.

    `start`: result of `begin_interval`; `mean`: sums of forces and powers over the interval's `steps_per_output` steps.
    """
    at = state_indices(y.shape[0])
    for m in range(3):
        out[i, out_col.ACCELERATION_X + m] = (y[at.ring_rate + m] - start[m]) / interval
        out[i, out_col.DISPLACEMENT_X + m] = y[at.ring + m]
        out[i, out_col.MEAN_RING_FORCE_X + m] = mean[col.RING_FORCE_X + m] / steps_per_output
        out[i, out_col.MEAN_ROLLING_POWER + m] = mean[col.ROLLING_POWER + m] / steps_per_output
    _, _, _, turned, relative = start
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
    omega_x, omega_y, omega_z = y[at.cage_rate], y[at.cage_rate + 1], y[at.cage_rate + 2]
    axes = cage_axes(cage_tilt(y[at.cage], y[at.cage + 1]))
    along = omega_x * axes[6] + omega_y * axes[7] + omega_z * axes[8]
    square = omega_x * omega_x + omega_y * omega_y + omega_z * omega_z
    double = model.cage_transverse * square + (model.cage_axial - model.cage_transverse) * along * along
    double += model.ring_mass * (y[at.ring_rate] ** 2 + y[at.ring_rate + 1] ** 2 + y[at.ring_rate + 2] ** 2)
    double += relative_energy(model.second_cage, turns.rate, along)
    height = model.ring_mass * y[at.ring + 1]
    space = model.space
    for j in range(n):
        slot = np.uint64(2 * j if j < n // 2 else 2 * j - n + 1)
        side = space[col.SIDE + slot]
        own_cosine, own_sine, rate = cage_of_row(turns, side)
        c = own_cosine * space[col.SLOT_COSINE + slot] - own_sine * space[col.SLOT_SINE + slot]
        s = own_sine * space[col.SLOT_COSINE + slot] + own_cosine * space[col.SLOT_SINE + slot]
        lean = side * model.tilt_sine
        e_x, e_y, e_z, _, _, _, z_x, z_y, z_z = slot_axes(axes, c, s, model.tilt_cosine, lean)
        w_x, w_y, w_z = omega_x + rate * axes[6], omega_y + rate * axes[7], omega_z + rate * axes[8]
        square = w_x * w_x + w_y * w_y + w_z * w_z
        across = square - (w_x * e_x + w_y * e_y + w_z * e_z) ** 2
        about = w_x * z_x + w_y * z_y + w_z * z_z
        reach = model.centre_distance + y[at.slide + j]
        double += model.roller_mass * (y[at.slide_rate + j] ** 2 + reach * reach * across)
        double += model.roller_axial * y[at.spin + j] ** 2 + model.roller_transverse * (square - about * about)
        height += model.roller_mass * reach * e_y
    return 0.5 * double - model.gravity * height


# Kernels of the families, in the order of `solvers.FAMILIES`.
ADVANCE = [
    advance_with(f"advance_{family}", step)
    for family, step in zip(FAMILIES, (runge_kutta_step, rosenbrock_step, leapfrog_step), strict=True)
]
