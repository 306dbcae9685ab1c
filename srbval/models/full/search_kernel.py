"""Kernels: find the points of a race that each roller may touch.

The points follow from the roller's angle, without a search among all. A column of the workspace is the contact of one
roller with one race; a lane group is `LANES` columns that are computed together, with one list (window) of race points.
The length of a group's list, which may be zero, is chosen to minimise computing time. Columns that need more points
(`frames_kernel.candidate_count`) are copied to other groups ("compacted"). Columns with a list of their own, near a
defect of a race or of a damaged roller, are copied to a group each ("single"). The result is the `plan`, see `columns`.
"""

import math

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.frames_kernel import OWN_POINTS, SKIP_MARGIN_M, candidate_code
from srbval.models.jit import kernel_part

# Cost of copying a column, in units of a lane group with one point of each circle: 0.2 costs interference 8 % more.
COPY_COST = 0.3


@kernel_part
def plan_contacts(slots, races, space, plan, count):
    """Choose the race points that each roller may touch, and enter them in `plan`.

    Returns the numbers `groups`, `compacted` and `single`, and the deepest penetration of all rollers and races [m].
    """
    lanes = np.uint64(col.LANES)
    groups, compacted, single = 0, 0, 0
    for race in range(2):
        first_copy, last = compacted, col.FIRST_SINGLE
        for begin in range(race * col.RACE, race * col.RACE + slots, col.LANES):
            code = code_of_group(np.uint64(begin), space)
            if code >= OWN_POINTS:
                single = plan_single_columns(race, begin, single, races, space, plan, count)
                code = code_of_group(np.uint64(begin), space)
            if code == 0.0:
                continue
            points, most = points_of_group(int(code), np.uint64(begin), space)
            if points > 0:
                for lane in range(lanes):
                    space[col.SHIFT + np.uint64(begin) + lane] = 0.5 * (points % 2)
                row = groups - 1
                if groups > 0 and plan[row, col.GROUP_END] == begin and plan[row, col.GROUP_WINDOW] == points - 1:
                    plan[groups - 1, col.GROUP_END] += col.LANES
                else:
                    plan_group(plan, groups, race, points - 1, begin)
                    groups += 1
            if points < most:
                # both lists are always written: the processor could not predict a branch
                for at in range(begin, begin + col.LANES):
                    own = int(space[col.CANDIDATES + np.uint64(at)])
                    several = own > max(points, 1)
                    plan_copy(plan, col.FIRST_COPY + compacted, at, own)
                    compacted += 1 if several else 0
                    plan_copy(plan, last - 1, at, own)
                    last -= 1 if own > points and not several else 0
        # columns of one point come last: the groups of the other columns have room for them
        for row in range(last, col.FIRST_SINGLE):
            plan_copy(plan, col.FIRST_COPY + compacted, plan[row, col.COPY_FROM], plan[row, col.COPY_POINTS])
            compacted += 1
        groups = plan_compacted_groups(race, first_copy, compacted, groups, space, plan)
    outer, inner = -1.0, -1.0
    for p in range(np.uint64(slots)):
        outer = max(outer, space[col.MIDDLE_DEPTH + p])
        inner = max(inner, space[col.MIDDLE_DEPTH + col.INNER + p])
    return groups, compacted, single, max(outer, inner)


@kernel_part
def plan_group(plan, row, race, window, first):
    """Enter `LANES` contacts, columns from `first` on, in a `row` of `plan`; `window`: their common list of points."""
    plan[row, col.GROUP_RACE], plan[row, col.GROUP_WINDOW] = race, window
    plan[row, col.GROUP_FIRST], plan[row, col.GROUP_END] = first, first + col.LANES


@kernel_part
def plan_copy(plan, row, column, points):
    """Enter in a `row` of `plan` that the contact in `column` needs a list of `points` points per circle of a race."""
    plan[row, col.COPY_FROM], plan[row, col.COPY_POINTS] = column, points


@kernel_part
def plan_compacted_groups(race, first_copy, end_copy, groups, space, plan):
    """Form groups of the contacts numbered `first_copy` to `end_copy` - 1 in `plan`; return the number of all groups.

    These contacts of a `race` need more points than the rest of their former group; `groups`: number of groups so far.
    """
    for begin in range(first_copy, end_copy, col.LANES):
        end = min(begin + col.LANES, end_copy)
        most = 1
        for i in range(begin, end):
            most = max(most, plan[col.FIRST_COPY + i, col.COPY_POINTS])
        to = col.COMPACTED + race * col.RACE + begin - first_copy
        for i in range(begin, end):
            row = col.FIRST_COPY + i
            plan[row, col.COPY_TO], plan[row, col.COPY_POINTS] = to + i - begin, most
        plan_group(plan, groups, race, most - 1, to)
        groups += 1
        for at in range(to + end - begin, to + col.LANES):
            space[col.O_X + np.uint64(at)] = col.FAR_M
    return groups


@kernel_part
def code_of_group(begin, space):
    """Sum the codes of the `LANES` contacts from column `begin` on, see `candidate_code`."""
    code = 0.0
    for lane in range(np.uint64(col.LANES)):
        code += space[col.CANDIDATE_CODE + begin + lane]
    return code


@kernel_part
def plan_single_columns(race, begin, single, races, space, plan, count):
    """Enter in `plan` contacts near defects among `LANES` columns from `begin`; return `single` plus their number."""
    window_of, highest, plain = races.window_of, races.highest, races.plain
    for at in range(begin, begin + col.LANES):
        column, slot = np.uint64(at), at - race * col.RACE
        if space[col.CANDIDATE_CODE + column] < OWN_POINTS:
            continue
        nearest = int(space[col.POSITION + column] + 0.5)
        # a state that is no longer finite has no position: never an index outside the array
        window = window_of[race, slot % 2, nearest if 0 <= nearest < count else 0]
        damage = space[col.DAMAGE + column]
        if window < plain and not damage > 0.0:
            space[col.CANDIDATE_CODE + column] = candidate_code(space[col.CANDIDATES + column])
            continue
        space[col.CANDIDATES + column], space[col.CANDIDATE_CODE + column] = 0.0, 0.0
        space[col.SHIFT + column] = 0.5
        if space[col.DEPTH_BOUND + column] > -(highest[race, window] + damage + SKIP_MARGIN_M):
            row = col.FIRST_SINGLE + single
            plan[row, col.SINGLE_RACE], plan[row, col.SINGLE_WINDOW] = race, window
            plan[row, col.SINGLE_FROM], plan[row, col.SINGLE_BASE] = at, window
            single += 1
    return single


@kernel_part
def points_of_group(code, begin, space):
    """Choose the number of points per circle for a group of contacts such that the computation takes least time.

    Contacts that need more points are copied to other groups, at the cost `COPY_COST`. `code`: from `code_of_group`;
    `begin`: first column of the group. Also returns the largest number of points that a contact of the group needs.
    """
    one, two, three = code % 64, code // 64 % 64, code // 4096
    if three == 0:
        all_copied = one * (COPY_COST + 1.0 / col.LANES) + two * (1.0 / col.LANES)
        some_copied = 1.0 + two * (COPY_COST + 2.0 / col.LANES)
        most = 2 if two > 0 else 1
        best = 1 if some_copied < most or two == 0 else 2
        return (0 if all_copied < min(some_copied, 2.0) else best), most
    best, points = 0, 0
    least, more = math.inf, 1.0
    while more > 0.0:
        limit = float(points)
        more = 0.0
        for lane in range(np.uint64(col.LANES)):
            own = space[col.CANDIDATES + begin + lane]
            more += COPY_COST + own / col.LANES if own > limit else 0.0
        if limit + more < least:
            best, least = points, limit + more
        points += 1
    return best, points - 1


@kernel_part
def turn_to_window(original, copy, slot, shift, spacing, space):
    """Store in column `copy` a race's radial and tangential axis at the middle of a roller's list of race points.

    `shift`: 0.5 if the middle of the list is the point nearest to the roller, 0 if it is the last before; `spacing` of
    points [rad]. Cosine and sine of the angle from the roller to this point are exact up to 0.1 rad.
    """
    position = space[col.POSITION + original]
    turn = (math.floor(position + shift) - position) * spacing
    square = turn * turn
    c = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square * (1.0 / 40320.0))))
    s = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0 - square * (1.0 / 362880.0))))
    s *= turn
    for component in range(3):
        row = np.uint64(component * col.STRIDE)
        m, n = space[col.M_X + row + slot], space[col.N_X + row + slot]
        space[col.A_X + row + copy], space[col.B_X + row + copy] = c * m + s * n, c * n - s * m


@kernel_part
def prepare_columns(groups, slots, space, plan, spacing, damping):
    """Turn the race's axes (`turn_to_window`) of contacts that keep their column; set the force sums of all to zero."""
    for i in range(groups):
        if plan[i, col.GROUP_FIRST] < col.COMPACTED:
            start = np.uint64(plan[i, col.GROUP_RACE] * col.RACE)
            for p in range(np.uint64(plan[i, col.GROUP_FIRST]) - start, np.uint64(plan[i, col.GROUP_END]) - start):
                column = start + p
                turn_to_window(column, column, p, space[col.SHIFT + column], spacing, space)
    for row in range(col.FIRST_SUM, col.LAST_SUM if damping is None else col.LAST_DAMPING_SUM):
        clear = np.uint64(row * col.STRIDE)
        for p in range(np.uint64(slots)):
            space[clear + p] = 0.0
            space[clear + col.INNER + p] = 0.0


@kernel_part
def spacing_of_windows(count, patch):
    """Compute the angle between neighbours of `count` race points [rad]; 0 if contacts are patches or slices."""
    if patch is None:
        return 0.0
    return 0.0 if patch.shape[1] > 0 else 2.0 * math.pi / count


@kernel_part
def copy_column(original, copy, space, damping):
    """Move a contact to column `copy`: copy its geometry, set force sums to 0, and put the original out of contact."""
    for row in range(col.FACED_ROWS, col.FRAME_ROWS):
        start = np.uint64(row * col.STRIDE)
        space[start + copy] = space[start + original]
    for row in range(col.FIRST_SUM, col.LAST_SUM if damping is None else col.LAST_DAMPING_SUM):
        space[np.uint64(row * col.STRIDE) + copy] = 0.0
    space[col.O_X + original] = col.FAR_M


@kernel_part
def gather_columns(compacted, single, space, plan, spacing, count, damping, slices):
    """Copy contacts to the columns in which `plan_contacts` planned to compute them; turn the race's axes there.

    `spacing` of race points: from `spacing_of_windows`; `slices`: `SliceTable`, or None if races are modelled by
    points. For the axes see `turn_to_window`.
    """
    own_spacing = 2.0 * math.pi / count if slices is None else 0.0
    for i in range(col.FIRST_COPY, col.FIRST_COPY + compacted):
        original, copy = np.uint64(plan[i, col.COPY_FROM]), np.uint64(plan[i, col.COPY_TO])
        copy_column(original, copy, space, damping)
        shift = 0.5 * (plan[i, col.COPY_POINTS] % 2)
        turn_to_window(original, copy, np.uint64(plan[i, col.COPY_FROM] % col.RACE), shift, spacing, space)
    for i in range(single):
        at = plan[col.FIRST_SINGLE + i, col.SINGLE_FROM]
        original, copy = np.uint64(at), np.uint64(col.SINGLE + i * col.LANES)
        copy_column(original, copy, space, damping)
        turn_to_window(original, copy, np.uint64(at % col.RACE), 0.5, own_spacing, space)


@kernel_part
def scatter_sums(compacted, single, space, plan, damping):
    """Add force, torque and energy of each contact's copy, made by `gather_columns`, to the contact's own column."""
    for i in range(col.FIRST_COPY, col.FIRST_COPY + compacted):
        add_column(np.uint64(plan[i, col.COPY_FROM]), np.uint64(plan[i, col.COPY_TO]), space, damping)
    for i in range(single):
        original = np.uint64(plan[col.FIRST_SINGLE + i, col.SINGLE_FROM])
        add_column(original, np.uint64(col.SINGLE + i * col.LANES), space, damping)


@kernel_part
def add_column(original, copy, space, damping):
    """Add the sums of force, torque and energy in the column `copy` to the column `original`."""
    for row in range(col.FIRST_SUM, col.LAST_SUM if damping is None else col.LAST_DAMPING_SUM):
        start = np.uint64(row * col.STRIDE)
        space[start + original] += space[start + copy]
