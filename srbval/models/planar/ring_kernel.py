"""Compiled integration of the planar ring model: Runge-Kutta steps, with rollers at prescribed angles."""

import math
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.models import outputs as col
from srbval.models.jit import kernel, kernel_part

# State: displacement [m] and velocity [m/s].
RING_X, RING_Y, RING_V_X, RING_V_Y = range(4)
STATE_SIZE = 4
# Rows of `ForceTable.values`.
TABLE_FORCE, TABLE_DAMPER, TABLE_DEPTH = range(3)
# Columns of `defects`: kind (see below), angle [rad], number of the roller, radius of the race [m], step of the
# positions in the defect's table [m], radius of the roller [m].
BUMP_KIND, BUMP_ANGLE, BUMP_ROLLER, RACE_RADIUS, POSITION_STEP, ROLLER_RADIUS = range(6)
BUMP_COLUMNS = 6
ON_OUTER, ON_INNER, ROLLER_ON_OUTER, ROLLER_ON_INNER = range(4)


class ForceTable(NamedTuple):
    """Table of an undamaged contact, `values`: rows force [N], damping [N s/m] and penetration [m].

    Its columns are for approaches of the rings from `start_m` to `deepest_m` in steps of `step_m`.
    """

    values: FloatArray
    start_m: float
    step_m: float
    deepest_m: float

    def at(self, approach_m: FloatArray) -> FloatArray:
        """Interpolate force, damping and penetration at each approach; constant outside the table's range."""
        grid = self.start_m + self.step_m * np.arange(self.values.shape[1])
        return np.array([np.interp(approach_m, grid, row) for row in self.values])


class Ring(NamedTuple):
    """Parameters of the planar ring model in SI units; balls are called rollers here.

    `plain`: table of an undamaged roller. `defects`, [D, BUMP_COLUMNS]: a row for each defect and each race that it
    meets; `bumps`, [D, approaches, positions]: force that the defect in this row adds [N], for approaches of the rings
    from `plain.start_m` in steps of `bump_step`, see `contacts.tabulate_bump`.
    """

    mass: float
    stiffness: float
    damping: float
    weight: float
    direction_x: float
    direction_y: float
    rollers: int
    rows: float
    plain: ForceTable
    defects: FloatArray
    bumps: FloatArray
    bump_step: float


class Motion(NamedTuple):
    """Prescribed angles of cage and shaft, and of rollers about their axes (`spun`) [rad]; radial load [N].

    Each is an array with a value for the start, the middle and the end of each step.
    """

    cage: FloatArray
    shaft: FloatArray
    spun: FloatArray
    radial: FloatArray


@kernel_part
def push_ring(y, cage, shaft, spun, ring):
    """Compute the force of all rollers on the ring, x and y [N], and the deepest penetration [m].

    `y`: state of the ring (displacement, velocity); `cage`, `shaft`, `spun`: angles at this time, see `Motion`. All
    rows of rollers have the same angles and forces, except that a defect acts in one row only.
    """
    plain, defects, bumps = ring.plain.values, ring.defects, ring.bumps
    force_x, force_y, deepest = 0.0, 0.0, -1.0
    last, bump_last, positions = plain.shape[1] - 2, bumps.shape[1] - 2, bumps.shape[2] - 1
    pi2 = 2.0 * math.pi
    for i in range(ring.rollers):
        angle = cage + pi2 * i / ring.rollers
        c, s = math.cos(angle), math.sin(angle)
        approach = -(y[RING_X] * c + y[RING_Y] * s)
        at = (approach - ring.plain.start_m) / ring.plain.step_m
        at = min(max(0.0, at), last + 0.999)  # a state that is no longer finite: never an index outside the array
        k = int(at)
        w = at - k
        deepest = max(deepest, (1.0 - w) * plain[TABLE_DEPTH, k] + w * plain[TABLE_DEPTH, k + 1])
        force = (1.0 - w) * plain[TABLE_FORCE, k] + w * plain[TABLE_FORCE, k + 1]
        damper = (1.0 - w) * plain[TABLE_DAMPER, k] + w * plain[TABLE_DAMPER, k + 1]
        force -= damper * (y[RING_V_X] * c + y[RING_V_Y] * s)
        force = ring.rows * max(force, 0.0)
        for j in range(defects.shape[0]):
            kind = int(defects[j, BUMP_KIND])
            if kind < ROLLER_ON_OUTER:
                away = angle - defects[j, BUMP_ANGLE] - (shaft if kind == ON_INNER else 0.0)
                arm = defects[j, RACE_RADIUS]
            elif int(defects[j, BUMP_ROLLER]) == i:
                away = spun + defects[j, BUMP_ANGLE] - (math.pi if kind == ROLLER_ON_INNER else 0.0)
                arm = defects[j, ROLLER_RADIUS]
            else:
                continue
            away -= pi2 * math.floor(away / pi2 + 0.5)
            position = abs(away) * arm / defects[j, POSITION_STEP]
            if not position < positions:
                continue
            at = (approach - ring.plain.start_m) / ring.bump_step
            at = min(max(0.0, at), bump_last + 0.999)
            k, m = int(at), int(position)
            w, v = at - k, position - m
            force += (1.0 - w) * ((1.0 - v) * bumps[j, k, m] + v * bumps[j, k, m + 1])
            force += w * ((1.0 - v) * bumps[j, k + 1, m] + v * bumps[j, k + 1, m + 1])
        force_x += force * c
        force_y += force * s
    return force_x, force_y, deepest


@kernel
def advance_ring(y, motion, step, ring, per_output, out, rate, trial):
    """Advance the state `y` in place by classical Runge-Kutta, `per_output` steps for each row of `out`.

    Fills acceleration, displacement, force on the ring and penetration in `out`, whose columns are those of
    `models.outputs`. `rate`, [4, STATE_SIZE], and `trial`, [STATE_SIZE]: working space.
    """
    stiffness, damping = ring.stiffness, ring.damping
    interval = step * per_output
    half = 0
    for i in range(out.shape[0]):
        before_x, before_y = y[RING_V_X], y[RING_V_Y]
        sum_x, sum_y, deepest = 0.0, 0.0, -1.0
        for _ in range(per_output):
            for stage in range(4):
                at = half + (stage + 1) // 2
                reach = step * (0.0 if stage == 0 else (1.0 if stage == 3 else 0.5))
                for k in range(STATE_SIZE):
                    trial[k] = y[k] + (reach * rate[stage - 1, k] if stage > 0 else 0.0)
                force_x, force_y, depth = push_ring(trial, motion.cage[at], motion.shaft[at], motion.spun[at], ring)
                rate[stage, RING_X], rate[stage, RING_Y] = trial[RING_V_X], trial[RING_V_Y]
                load_x = motion.radial[at] * ring.direction_x + force_x
                load_y = motion.radial[at] * ring.direction_y + ring.weight + force_y
                rate[stage, RING_V_X] = (load_x - stiffness * trial[RING_X] - damping * trial[RING_V_X]) / ring.mass
                rate[stage, RING_V_Y] = (load_y - stiffness * trial[RING_Y] - damping * trial[RING_V_Y]) / ring.mass
                share = 1.0 / 6.0 if stage == 0 or stage == 3 else 1.0 / 3.0
                sum_x += share * force_x
                sum_y += share * force_y
                deepest = max(deepest, depth)
            for k in range(STATE_SIZE):
                y[k] += step / 6.0 * (rate[0, k] + 2.0 * rate[1, k] + 2.0 * rate[2, k] + rate[3, k])
            half += 2
        out[i, col.ACCELERATION_X] = (y[RING_V_X] - before_x) / interval
        out[i, col.ACCELERATION_Y] = (y[RING_V_Y] - before_y) / interval
        out[i, col.DISPLACEMENT_X], out[i, col.DISPLACEMENT_Y] = y[RING_X], y[RING_Y]
        out[i, col.MEAN_RING_FORCE_X], out[i, col.MEAN_RING_FORCE_Y] = sum_x / per_output, sum_y / per_output
        out[i, col.MAX_PENETRATION] = deepest
