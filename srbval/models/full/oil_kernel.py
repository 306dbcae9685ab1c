"""Kernels: effects of oil besides traction: rolling resistance, drag, friction in the cage's pockets.

These forces are small beside the load and change slowly, so steps treat them explicitly: rolling resistance alone would
stop a roller's spin in 0.3 s. Equations: `srbval.models.oil`. A pocket's friction along the slot (10 N) is left out.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.jit import kernel_part

THERMAL, THERMAL_EXPONENT = 3.94, 0.62  # of Murch & Wilson
LEAST_RAD_S = 1e-6


class OilLaw(NamedTuple):
    """Constants of the oil's forces on rollers; all are numbers except `rolling`.

    `rolling`, [2 races, 2]: couple that resists rolling [N m] at 1 rad/s between race and roller. The first number is
    for contacts shorter than their roller and is divided by the square root of the load [N]; the second is for contacts
    as long as their roller and is divided by the fourth root of the load. `heating`: heating number L at a rolling
    speed of 1 m/s; `drag`: force on a roller over its speed squared [kg/m]; `pocket`: friction coefficient at the cage.
    """

    rolling: Any
    heating: float
    drag: float
    pocket: float


@kernel_part
def rolling_speed(slices, cage, shaft):
    """Compute the speed at which contacts move over the rollers [m/s], mean of both races; `cage`, `shaft`: [rad/s]."""
    return 0.5 * (slices.outer_radius * abs(cage) + slices.inner_radius * abs(shaft - cage)) + 1e-6


@kernel_part
def thermal_share(heating, rolling):
    """Compute the factor of shear heating on an oil film, 3.94 / (3.94 + (`heating` v^2)^0.62), v = `rolling` [m/s]."""
    return THERMAL / (THERMAL + (heating * rolling * rolling) ** THERMAL_EXPONENT)


@kernel_part
def rate_power(rate):
    """Compute rate^0.6484 from square roots, which is fast; the exponent of Goksem & Hargreaves is 0.648."""
    half = math.sqrt(np.float32(rate))
    eighth = math.sqrt(math.sqrt(half))
    last = math.sqrt(math.sqrt(math.sqrt(eighth)))
    return np.float64(half * eighth * last * math.sqrt(last))


@kernel_part
def resist_rolling(space, j, short, full):
    """Add the couple that resists rolling to the torque of contact `j`; returns the power lost to it [W].

    `short`, `full`: factors, see `OilLaw.rolling`, for contacts shorter than their roller and contacts as long as it.
    """
    root = math.sqrt(math.sqrt(np.float32(space[col.F_X + j] ** 2 + space[col.F_Y + j] ** 2 + space[col.F_Z + j] ** 2)))
    shorter, longest = short * root, full * math.sqrt(root)
    rate = space[col.W_Z + j]
    size = abs(rate) + LEAST_RAD_S
    couple = rate_power(size) * (shorter if shorter < longest else longest) * rate / size
    space[col.T_Z + j] += couple
    return couple * rate


@kernel_part
def add_oil_forces(oil, model, slots, cage, shaft, totals):
    """Add the oil's rolling resistance and the pockets' friction to the rollers' torques, and the powers to `totals`.

    `cage`, `shaft`: speeds [rad/s]. Also writes the couples on the cages to row `ON_CAGE` of the workspace. Call it
    after all contact forces. No effect if `oil` (`OilLaw`) is None.
    """
    if oil is None:
        return
    space = model.space
    radius, weight = model.law.roller_radius, model.roller_mass * model.gravity
    thermal = thermal_share(oil.heating, rolling_speed(model.slices, cage, shaft))
    outer_short, outer_full = thermal * oil.rolling[0, 0], thermal * oil.rolling[0, 1]
    inner_short, inner_full = thermal * oil.rolling[1, 0], thermal * oil.rolling[1, 1]
    drag_factor, pocket, centre = oil.drag, oil.pocket, model.centre_distance
    rolled = dragged = rubbed = 0.0
    for p in range(slots):
        there = space[col.SIDE + p] * space[col.SIDE + p]  # 0 of an empty slot
        rolled += resist_rolling(space, p, outer_short, outer_full)
        rolled += resist_rolling(space, p + col.INNER, inner_short, inner_full)
        speed = (centre + space[col.SLIDE + p]) * space[col.CAGE_Z + p]
        drag = -drag_factor * there * abs(speed) * speed
        dragged -= drag * speed
        push = space[col.F_Y + p] + space[col.F_Y + p + col.INNER] + drag + weight * space[col.Y_WY + p]
        turning = space[col.SPIN + p] - space[col.CAGE_Z + p]
        couple = -pocket * there * abs(push) * radius * turning / (abs(turning) + LEAST_RAD_S)
        space[col.T_Z + p] += couple  # the ring does not turn: only the roller uses this torque
        space[col.ON_CAGE + p] = (centre + space[col.SLIDE + p]) * drag - couple
        rubbed -= couple * turning
    totals[col.ROLLING_POWER], totals[col.DRAG_POWER], totals[col.POCKET_POWER] = rolled, dragged, rubbed
