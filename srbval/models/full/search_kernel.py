"""Kernels: which points of a race each roller may touch.

Candidates follow from the angle, no search among points is needed. `touched_points` says how many points of a circle a
column needs; an eight of columns is given a window that holds enough for most of them, and those that need more, or
that alone of their eight need any, are moved together. The rows of `plan`: up to `RUNS`, eights: race, window, first
column, end; up to `LONE`, the columns that are moved: column it is copied from, column it is copied to, points, 0; from
`LONE`, the columns that stand alone: race, window, column it is copied from, window it is made from.
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
    MOVED,
    N_X,
    N_Y,
    N_Z,
    NEED,
    O_X,
    PLACE,
    RACE,
    SHIFT,
    STORED,
    STRIDE,
    SUMS,
    TOUCHED,
)  # fmt: skip
from srbval.models.full.frames_kernel import OWN, SKIP_MARGIN_M, need_of
from srbval.models.full.point_cloud import FAR_M
from srbval.models.jit import kernel

RUNS = 64  # more than there can be: one for each eight of both races, where they stand and moved
LONE = RUNS + 2 * RACE + 2
# Of a column, in units of an eight's meeting one point of each circle: at 0.2 interference costs 8 % more.
MOVE_COST = 0.3
FACED_ROWS = 6  # rows of A and B
FRAME_ROWS, FIRST_SUM, LAST_SUM, LAST_DAMPING_SUM = FRAME.stop, SUMS.start, SUMS.stop, DAMPING_SUMS.stop
INNER = np.uint64(RACE)


@kernel
def look_up(places, races, space, plan, count):
    """Decide who looks where: number of eights, of columns moved, of columns alone, and the deepest penetration [m].

    See `Parameters` for `races`, `Scratch` for `places` and the rest; `count`: points in a circle.
    """
    lanes = np.uint64(AT_ONCE)
    eights, moved, lone = 0, 0, 0
    for race in range(2):
        first_moved, last = moved, LONE
        for begin in range(race * RACE, race * RACE + places, AT_ONCE):
            need = need_of_eight(np.uint64(begin), space)
            if need >= OWN:
                lone = look_alone(race, begin, lone, races, space, plan, count)
                need = need_of_eight(np.uint64(begin), space)
            if need == 0.0:
                continue
            kept, most = worth_keeping(int(need), np.uint64(begin), space)
            if kept > 0:
                for lane in range(lanes):
                    space[SHIFT + np.uint64(begin) + lane] = 0.5 * (kept % 2)
                if eights > 0 and plan[eights - 1, 3] == begin and plan[eights - 1, 1] == kept - 1:
                    plan[eights - 1, 3] += AT_ONCE
                else:
                    plan[eights, 0], plan[eights, 1], plan[eights, 2] = race, kept - 1, begin
                    plan[eights, 3] = begin + AT_ONCE
                    eights += 1
            if kept < most:
                # both lists are written to in any case, as a branch could not be foreseen
                for at in range(begin, begin + AT_ONCE):
                    own = int(space[TOUCHED + np.uint64(at)])
                    several = own > max(kept, 1)
                    plan[RUNS + moved, 0], plan[RUNS + moved, 2] = at, own
                    moved += 1 if several else 0
                    plan[last - 1, 0], plan[last - 1, 2] = at, own
                    last -= 1 if own > kept and not several else 0
        # those of one point last: the others' eights have room for them
        for row in range(last, LONE):
            plan[RUNS + moved, 0], plan[RUNS + moved, 2] = plan[row, 0], plan[row, 2]
            moved += 1
        for begin in range(first_moved, moved, AT_ONCE):
            end = min(begin + AT_ONCE, moved)
            most = 1
            for i in range(begin, end):
                most = max(most, plan[RUNS + i, 2])
            to = MOVED + race * RACE + begin - first_moved
            for i in range(begin, end):
                plan[RUNS + i, 1], plan[RUNS + i, 2] = to + i - begin, most
            plan[eights, 0], plan[eights, 1], plan[eights, 2], plan[eights, 3] = race, most - 1, to, to + AT_ONCE
            eights += 1
            for at in range(to + end - begin, to + AT_ONCE):
                space[O_X + np.uint64(at)] = FAR_M
    return eights, moved, lone, deepest_of(places, space)


@kernel
def need_of_eight(begin, space):
    """Sum of the codes of an eight of columns, see `need_of`."""
    need = 0.0
    for lane in range(np.uint64(AT_ONCE)):
        need += space[NEED + begin + lane]
    return need


@kernel
def look_alone(race, begin, lone, races, space, plan, count):
    """Find the columns with points of their own in an eight that may have some: `lone` more of them."""
    window_of, highest, plain = races.window_of, races.highest, races.plain
    for at in range(begin, begin + AT_ONCE):
        column, place = np.uint64(at), at - race * RACE
        if space[NEED + column] < OWN:
            continue
        nearest = int(space[PLACE + column] + 0.5)
        # a state that is no longer finite has no place: anything but a look outside the array
        window = window_of[race, place % 2, nearest if 0 <= nearest < count else 0]
        damage = space[DAMAGE + np.uint64(place)]
        if window < plain and not damage > 0.0:
            space[NEED + column] = need_of(space[TOUCHED + column])
            continue
        space[TOUCHED + column], space[NEED + column], space[SHIFT + column] = 0.0, 0.0, 0.5
        if space[BOUND + column] > -(highest[race, window] + damage + SKIP_MARGIN_M):
            row = LONE + lone
            plan[row, 0], plan[row, 1], plan[row, 2], plan[row, 3] = race, window, at, window
            lone += 1
    return lone


@kernel
def worth_keeping(need, begin, space):
    """How many points of each circle an eight of columns had best meet where it stands, and how many the neediest.

    Those that need more move, at a cost. `need`: see `need_of_eight`, not 0.
    """
    touch, two, three = need % 64, need // 64 % 64, need // 4096
    if three == 0:
        all_moved = touch * (MOVE_COST + 1.0 / AT_ONCE) + two * (1.0 / AT_ONCE)
        some_moved = 1.0 + two * (MOVE_COST + 2.0 / AT_ONCE)
        most = 2 if two > 0 else 1
        kept = 1 if some_moved < most or two == 0 else 2
        return (0 if all_moved < min(some_moved, 2.0) else kept), most
    kept, points = 0, 0
    least, more = math.inf, 1.0
    while more > 0.0:
        limit = float(points)
        more = 0.0
        for lane in range(np.uint64(AT_ONCE)):
            own = space[TOUCHED + begin + lane]
            more += MOVE_COST + own / AT_ONCE if own > limit else 0.0
        if limit + more < least:
            kept, least = points, limit + more
        points += 1
    return kept, points - 1


@kernel
def deepest_of(places, space):
    """Greatest depth of all columns [m]; a row of sums that is not yet in use serves to compare both races at once."""
    for p in range(np.uint64(places)):
        outer, inner = space[DEPTH + p], space[DEPTH + INNER + p]
        space[STORED + p] = outer if outer > inner else inner
    a, b, c, d = -1.0, -1.0, -1.0, -1.0
    for p in range(np.uint64(0), np.uint64(places), np.uint64(4)):
        a = max(a, space[STORED + p])
        b = max(b, space[STORED + p + np.uint64(1)])
        c = max(c, space[STORED + p + np.uint64(2)])
        d = max(d, space[STORED + p + np.uint64(3)])
    return max(max(a, b), max(c, d))


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
def face(original, copy, place, shift, spacing, space):
    """Turn a column, or its copy, to its window's middle point."""
    m_x, m_y, m_z = space[M_X + place], space[M_Y + place], space[M_Z + place]
    n_x, n_y, n_z = space[N_X + place], space[N_Y + place], space[N_Z + place]
    c, s = turned(space[PLACE + original], shift, spacing)
    space[A_X + copy], space[B_X + copy] = c * m_x + s * n_x, c * n_x - s * m_x
    space[A_Y + copy], space[B_Y + copy] = c * m_y + s * n_y, c * n_y - s * m_y
    space[A_Z + copy], space[B_Z + copy] = c * m_z + s * n_z, c * n_z - s * m_z


@kernel
def face_points(eights, places, space, plan, spacing, damping):
    """Turn the columns of the `eights` that stand in their places to their windows' points; clear all columns' sums.

    `spacing`: angle between points [rad].
    """
    for i in range(eights):
        if plan[i, 2] < MOVED:
            start = np.uint64(plan[i, 0] * RACE)
            for p in range(np.uint64(plan[i, 2]) - start, np.uint64(plan[i, 3]) - start):
                column = start + p
                face(column, column, p, space[SHIFT + column], spacing, space)
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
def copy_column(original, copy, space, damping):
    """Copy a column but for the axes that `face` turns, clear the copy's sums and put the column out of reach."""
    for row in range(FACED_ROWS, FRAME_ROWS):
        start = np.uint64(row * STRIDE)
        space[start + copy] = space[start + original]
    for row in range(FIRST_SUM, LAST_SUM if damping is None else LAST_DAMPING_SUM):
        space[np.uint64(row * STRIDE) + copy] = 0.0
    space[O_X + original] = FAR_M


@kernel
def set_apart(moved, lone, space, plan, spacing, count, damping):
    """Copy the columns that are moved or stand alone, each turned to its own points.

    `spacing` of the points that moved columns meet, see `spacing_of`; the others always meet one of `count` points.
    """
    for i in range(RUNS, RUNS + moved):
        original, copy = np.uint64(plan[i, 0]), np.uint64(plan[i, 1])
        copy_column(original, copy, space, damping)
        face(original, copy, np.uint64(plan[i, 0] % RACE), 0.5 * (plan[i, 2] % 2), spacing, space)
    for i in range(lone):
        original, copy = np.uint64(plan[LONE + i, 2]), np.uint64(ALONE + i * AT_ONCE)
        copy_column(original, copy, space, damping)
        face(original, copy, np.uint64(plan[LONE + i, 2] % RACE), 0.5, 2.0 * math.pi / count, space)


@kernel
def bring_back(moved, lone, space, plan, damping):
    """Add the sums of the copied columns to those of the columns they were copied from."""
    for i in range(moved):
        add_column(np.uint64(plan[RUNS + i, 0]), np.uint64(plan[RUNS + i, 1]), space, damping)
    for i in range(lone):
        add_column(np.uint64(plan[LONE + i, 2]), np.uint64(ALONE + i * AT_ONCE), space, damping)


@kernel
def add_column(original, copy, space, damping):
    """Add the sums of a column's copy to its own."""
    for row in range(FIRST_SUM, LAST_SUM if damping is None else LAST_DAMPING_SUM):
        start = np.uint64(row * STRIDE)
        space[start + original] += space[start + copy]
