"""Kernels: which points of a race each roller may touch.

Candidates follow from the angle, no search among points is needed. Columns within reach are covered by eights, each
from the first column that no eight covers yet; an eight looks into the narrow window if all of its columns may. The
first `RUNS` rows of `plan` hold runs of eights: race, window, first column, end; the rows behind them the columns that
stand alone: race, window, column it was copied from, window it was made from.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    A_X,
    A_Y,
    A_Z,
    ALONE,
    AT_ONCE,
    B_X,
    B_Y,
    B_Z,
    BOUND,
    DAMAGE,
    DAMPING_SUMS,
    DEPTH,
    FRAME,
    M_X,
    M_Y,
    M_Z,
    N_X,
    N_Y,
    N_Z,
    O_X,
    PLACE,
    RACE,
    SHIFT,
    STRIDE,
    SUMS,
)  # fmt: skip
from srbval.models.full.point_cloud import FAR_M, NARROW, PLAIN
from srbval.models.jit import kernel

SKIP_MARGIN_M = 2e-6  # a roller further than this (and the highest bump) from a race is not looked at
RUNS = 32  # more than there can be: one for each eight of both races
FRAME_ROWS, FIRST_SUM, LAST_SUM, LAST_DAMPING_SUM = FRAME.stop, SUMS.start, SUMS.stop, DAMPING_SUMS.stop
INNER = np.uint64(RACE)


@kernel
def look_up(n, races, space, plan, count):
    """Decide who looks where: number of runs, of columns that stand alone, and the deepest penetration [m].

    `n` rollers; see `Parameters` for `races`, `Scratch` for the rest; `count`: points in a circle.
    """
    window_of, highest = races.window_of, races.highest
    runs, lone = 0, 0
    deepest = -1.0
    for race in range(2):
        shallow = races.outer_shallow if race == 0 else races.inner_shallow
        covered = 0  # places before this one are
        end = -1  # of the last run, if the next eight follows on it
        for place in range(n):
            column = np.uint64(race * RACE + place)
            depth, bound = space[DEPTH + column], space[BOUND + column]
            deepest = depth if depth > deepest else deepest
            if place >= covered:
                space[SHIFT + column] = 0.5
                if bound > -SKIP_MARGIN_M:
                    covered = place + AT_ONCE
                    reach = bound
                    for other in range(place + 1, min(covered, n)):
                        own = space[BOUND + np.uint64(race * RACE + other)]
                        reach = own if own > reach else reach
                    window = NARROW if reach < shallow else PLAIN
                    shift = 0.0 if window == NARROW else 0.5
                    for other in range(place, covered):
                        space[SHIFT + np.uint64(race * RACE + other)] = shift
                    if place != end or plan[runs - 1, 1] != window:
                        plan[runs, 0], plan[runs, 1], plan[runs, 2] = race, window, race * RACE + place
                        runs += 1
                    plan[runs - 1, 3] = race * RACE + covered
                    end = covered
            nearest = int(space[PLACE + column] + 0.5)
            # a state that is no longer finite has no place: anything but a look outside the array
            window = window_of[race, place % 2, nearest if 0 <= nearest < count else 0]
            damage = space[DAMAGE + np.uint64(place)]
            if (window > NARROW or damage > 0.0) and bound > -(highest[race, window] + damage + SKIP_MARGIN_M):
                space[SHIFT + column] = 0.5
                at = RUNS + lone
                plan[at, 0], plan[at, 1], plan[at, 2], plan[at, 3] = race, window, race * RACE + place, window
                lone += 1
    return runs, lone, deepest


@kernel
def turned(place, shift, spacing):
    """Cosine and sine of the angle from a roller to its window's middle point.

    The angle is at most `spacing`: taken from their series, exact to rounding up to 0.1 rad (60 points in a circle).
    """
    turn = (math.floor(place + shift) - place) * spacing
    square = turn * turn
    cosine = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square * (1.0 / 40320.0))))
    sine = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0 - square * (1.0 / 362880.0))))
    return cosine, sine * turn


@kernel
def face_points(places, space, spacing, damping):
    """Turn every column's axes to its window's middle point, points `spacing` [rad] apart, and clear its sums."""
    for p in range(np.uint64(places)):
        m_x, m_y, m_z = space[M_X + p], space[M_Y + p], space[M_Z + p]
        n_x, n_y, n_z = space[N_X + p], space[N_Y + p], space[N_Z + p]
        c, s = turned(space[PLACE + p], space[SHIFT + p], spacing)
        space[A_X + p], space[A_Y + p], space[A_Z + p] = c * m_x + s * n_x, c * m_y + s * n_y, c * m_z + s * n_z
        space[B_X + p], space[B_Y + p], space[B_Z + p] = c * n_x - s * m_x, c * n_y - s * m_y, c * n_z - s * m_z
        q = p + INNER
        c, s = turned(space[PLACE + q], space[SHIFT + q], spacing)
        space[A_X + q], space[A_Y + q], space[A_Z + q] = c * m_x + s * n_x, c * m_y + s * n_y, c * m_z + s * n_z
        space[B_X + q], space[B_Y + q], space[B_Z + q] = c * n_x - s * m_x, c * n_y - s * m_y, c * n_z - s * m_z
    for row in range(FIRST_SUM, LAST_SUM if damping is None else LAST_DAMPING_SUM):
        clear = np.uint64(row * STRIDE)
        for p in range(np.uint64(places)):
            space[clear + p] = 0.0
            space[clear + INNER + p] = 0.0


@kernel
def spacing_of(count, patch):
    """Angle between the points that columns turn to [rad]; 0: a `patch` follows its roller."""
    return 2.0 * math.pi / count if patch is None else 0.0


@kernel
def face_alone(lone, space, plan, count, patch):
    """Turn the columns that stand alone to their points, where a `patch` has kept `face_points` from it."""
    if patch is not None:
        for i in range(lone):
            original, copy = np.uint64(plan[RUNS + i, 2]), np.uint64(ALONE + i * AT_ONCE)
            place = np.uint64(plan[RUNS + i, 2] % RACE)
            m_x, m_y, m_z = space[M_X + place], space[M_Y + place], space[M_Z + place]
            n_x, n_y, n_z = space[N_X + place], space[N_Y + place], space[N_Z + place]
            c, s = turned(space[PLACE + original], space[SHIFT + original], 2.0 * math.pi / count)
            space[A_X + copy], space[B_X + copy] = c * m_x + s * n_x, c * n_x - s * m_x
            space[A_Y + copy], space[B_Y + copy] = c * m_y + s * n_y, c * n_y - s * m_y
            space[A_Z + copy], space[B_Z + copy] = c * m_z + s * n_z, c * n_z - s * m_z


@kernel
def set_apart(lone, space, plan, damping):
    """Copy the columns that stand alone to eights of their own and put the copied ones out of reach."""
    for i in range(lone):
        original = np.uint64(plan[RUNS + i, 2])
        copy = np.uint64(ALONE + i * AT_ONCE)
        for row in range(FRAME_ROWS):
            start = np.uint64(row * STRIDE)
            space[start + copy] = space[start + original]
        for row in range(FIRST_SUM, LAST_SUM if damping is None else LAST_DAMPING_SUM):
            space[np.uint64(row * STRIDE) + copy] = 0.0
        space[O_X + original] = FAR_M


@kernel
def bring_back(lone, space, plan, damping):
    """Add the sums of the columns that stand alone to those of the columns they were copied from."""
    for i in range(lone):
        original = np.uint64(plan[RUNS + i, 2])
        copy = np.uint64(ALONE + i * AT_ONCE)
        for row in range(FIRST_SUM, LAST_SUM if damping is None else LAST_DAMPING_SUM):
            start = np.uint64(row * STRIDE)
            space[start + original] += space[start + copy]
