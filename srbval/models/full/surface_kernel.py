"""Kernel: waves of races and rollers, under the contacts.

A height towards the other surface brings the race of one contact that much nearer to its roller, along the slot: along
the normal less by the cosine of its lean, 0.6 % at a contact's ends. The slope of a wave tilts no normal, and how fast
it passes counts for no damper (at 3 kHz and 10 us 2 % of the force).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.frames_kernel import OWN_POINTS, SKIP_MARGIN_M, candidate_code
from srbval.models.jit import kernel


class SurfaceHeights(NamedTuple):
    """Heights at even angles [m]: of both `races`, [2 races, 2 rows, H], and all `rollers`, [2 M, K]; none: H = K = 0.

    Angles of a race count from its first point, those of a roller from where its slot points outwards at the start.
    """

    races: Any
    rollers: Any


@kernel
def add_heights(surface, rotation, count, space):
    """Bring the races of all columns nearer by the heights under them. `rotation` of the rollers [rad]."""
    races, rollers = surface.races, surface.rollers
    if races.shape[2] == 0:
        return
    half = rotation.shape[0] // 2
    for roller in range(2 * half):
        row = roller // half
        slot = 2 * (roller - row * half) + row
        turned = rotation[roller] / (2.0 * math.pi)
        for race in range(2):
            j = np.uint64(race * col.RACE + slot)
            first, second, share = place_in_table(space[col.POSITION + j] / count, races.shape[2])
            height = (1.0 - share) * races[race, row, first] + share * races[race, row, second]
            # the outer race is met in front of the slot, the inner one behind
            first, second, share = place_in_table(0.5 * race - turned, rollers.shape[1])
            height += (1.0 - share) * rollers[roller, first] + share * rollers[roller, second]
            space[col.O_X + j] += height if race == 1 else -height
            space[col.DEPTH + j] += height
            space[col.BOUND + j] += height
            candidates = 1.0 if space[col.BOUND + j] > -SKIP_MARGIN_M else 0.0
            space[col.CANDIDATES + j] = candidates
            if space[col.CANDIDATE_CODE + j] < OWN_POINTS:
                space[col.CANDIDATE_CODE + j] = candidate_code(candidates)


@kernel
def place_in_table(turns, size):
    """The entries before and behind an angle in a table of `size` around a body, and the share of the latter."""
    place = (turns - math.floor(turns)) * size
    first = int(place)
    first = first if 0 <= first < size else 0  # of a state that is no longer finite, too
    return first, first + 1 if first + 1 < size else 0, place - first
