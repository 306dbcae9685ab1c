"""Kernels: what the oil does besides traction: rolling resistance, drag, friction in the cage's pockets.

Each is small beside the forces that carry the load and changes slowly, so that steps take it explicitly: a roller's
spin would relax under its rolling resistance in 0.3 s. All equations stand at `srbval.models.film` and `srbval.models.oil`.
Left out: that a pocket's friction also pushes its roller along the slot, some 10 N.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.jit import kernel_part

THERMAL, THERMAL_EXPONENT = 3.94, 0.62  # of Murch & Wilson, see `film.thermal_factor`
LEAST_LOAD_N = 1e-3  # of a contact that resists rolling
LEAST_RAD_S = 1e-6


class OilLaw(NamedTuple):
    """Constants of what the oil does to rollers. Numbers only, but for `rolling`.

    `rolling`, [2 races, 2]: logarithms of the couple at 1 rad/s and 1 N, of a contact shorter than its roller and of
    one as long; `exponents`: of the relative rate and of the load, shorter and as long; `heating`: L of shear heating
    at 1 m/s; `drag`: force over the square of a roller's speed [kg/m]; `pocket`: coefficient of friction there.
    """

    rolling: Any
    exponents: tuple[float, float, float]
    heating: float
    drag: float
    pocket: float


@kernel_part
def rolling_speed(slices, cage, shaft):
    """Speed at which contacts move over the rollers' surface [m/s], mean of both races', at these speeds [rad/s]."""
    return 0.5 * (slices.outer_radius * abs(cage) + slices.inner_radius * abs(shaft - cage)) + 1e-6


@kernel_part
def thermal_share(heating, rolling):
    """`film.thermal_factor`."""
    return THERMAL / (THERMAL + (heating * rolling * rolling) ** THERMAL_EXPONENT)


@kernel_part
def add_oil_forces(oil, model, slots, cage, shaft, totals):
    """Add rolling resistance and pockets' couples to the columns' torques; fill the couples on cages, and the powers.

    The columns' forces are those of the contacts, summed over all that touch. Nothing happens without `oil`.
    """
    if oil is None:
        return
    space, spin_exponent = model.scratch.space, oil.exponents[0]
    radius, weight = model.law.roller_radius, model.roller_mass * model.gravity
    thermal = math.log(thermal_share(oil.heating, rolling_speed(model.slices, cage, shaft)))
    rolled = dragged = rubbed = 0.0
    for p in range(slots):
        side = space[col.SIDE + p]
        if side == 0.0:
            continue
        for race in range(2):
            j = p + np.uint64(race * col.RACE)
            square = space[col.F_X + j] ** 2 + space[col.F_Y + j] ** 2 + space[col.F_Z + j] ** 2
            if square > LEAST_LOAD_N * LEAST_LOAD_N:
                rate = space[col.W_Z + j]
                size, load = abs(rate) + LEAST_RAD_S, 0.5 * math.log(square)
                shorter = oil.rolling[race, 0] + oil.exponents[1] * load
                full = oil.rolling[race, 1] + oil.exponents[2] * load
                couple = math.exp(spin_exponent * math.log(size) + thermal + (shorter if shorter < full else full))
                space[col.T_Z + j] += couple * rate / size
                rolled += couple * rate * rate / size
        speed = (model.centre_distance + space[col.SLIDE + p]) * space[col.CAGE_Z + p]
        drag = -oil.drag * abs(speed) * speed
        dragged -= drag * speed
        push = space[col.F_Y + p] + space[col.F_Y + p + col.INNER] + drag + weight * space[col.Y_WY + p]
        turning = space[col.SPIN + p] - space[col.CAGE_Z + p]
        couple = -oil.pocket * abs(push) * radius * turning / (abs(turning) + LEAST_RAD_S)
        space[col.T_Z + p] += couple  # the outer ring does not turn: no torque but the roller's is read from there
        space[col.ON_CAGE + p] = (model.centre_distance + space[col.SLIDE + p]) * drag - couple
        rubbed -= couple * turning
    totals[col.ROLLING_POWER], totals[col.DRAG_POWER], totals[col.POCKET_POWER] = rolled, dragged, rubbed


@kernel_part
def oil_on_cages(oil, model, slots, relative, on_cages):
    """Torque on the angle between both cages and on the cages, x, y, z, with what `add_oil_forces` found [N m]."""
    if oil is None:
        return relative, on_cages
    space = model.scratch.space
    g_x, g_y, g_z = on_cages
    for p in range(slots):
        couple = space[col.ON_CAGE + p]
        g_x += couple * space[col.Z_WX + p]
        g_y += couple * space[col.Z_WY + p]
        g_z += couple * space[col.Z_WZ + p]
        relative += couple * model.tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
    return relative, (g_x, g_y, g_z)
