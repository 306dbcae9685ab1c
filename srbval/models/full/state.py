"""Layout of the full model's state vector, see the table at `srbval.models.full`."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.models.jit import kernel_part

CAGE_AND_RING = 6  # coordinates besides the rollers': three gimbal angles, three displacements


class StateIndices(NamedTuple):
    """Index of the first value of each part of a state vector; velocities follow from `slide_rate` on.

    `relative_angle`, `relative_rate`: of a second cage; without one there is nothing, and the next part begins there.
    """

    slide: int
    rotation: int
    cage: int
    ring: int
    relative_angle: int
    slide_rate: int
    spin: int
    cage_rate: int
    ring_rate: int
    relative_rate: int


def indices_of(rollers: int, half: int) -> StateIndices:
    """Layout of the state of `rollers` rollers, both rows together, and `half` coordinates."""
    cage = 2 * rollers
    return StateIndices(
        0, rollers, cage, cage + 3, cage + 6, half, half + rollers, half + cage, half + cage + 3, half + cage + 6
    )


state_indices = kernel_part(indices_of)  # for kernels


class StateLayout:
    """The parts of the state of so many rollers as slices, so that ``y[layout.ring]`` is the ring's displacement.

    `half` is the number of coordinates, with which the velocities begin; `velocities` are the parts of that half in
    order, `parts` those of both; `shaft_cage_rate` is the cage's angular velocity about the shaft. `relative_angle` and
    `relative_rate` are empty with one cage, and then not among the parts.
    """

    def __init__(self, rollers: int, cages: int = 1) -> None:
        self.rollers = rollers
        self.half = half = 2 * rollers + CAGE_AND_RING + cages - 1
        parts = [slice(*ends) for ends in itertools.pairwise((*indices_of(rollers, half), 2 * half))]
        self.slide, self.rotation, self.cage, self.ring, self.relative_angle = parts[:5]
        self.slide_rate, self.spin, self.cage_rate, self.ring_rate, self.relative_rate = parts[5:]
        self.shaft_cage_rate = slice(self.ring_rate.start - 1, self.ring_rate.start)
        self.velocities = parts[5:] if cages > 1 else parts[5:-1]
        self.parts = (parts[:5] if cages > 1 else parts[:4]) + self.velocities


def layout_of(state: NDArray[np.float64]) -> StateLayout:
    """Layout of a state vector."""
    rollers, more = divmod(len(state) // 2 - CAGE_AND_RING, 2)
    return StateLayout(rollers, 1 + more)
