"""Layout of the full model's state vector, see the table at `srbval.models.full`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.models.jit import kernel

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


state_indices = kernel(indices_of)  # for kernels


class StateLayout:
    """The parts of the state of so many rollers as slices, so that ``y[layout.ring]`` is the ring's displacement.

    `half` is the number of coordinates, with which the velocities begin; `coordinates` and `velocities` are the parts
    of either half in order, `parts` all of them; `shaft_cage_rate` is the cage's angular velocity about the shaft.
    `relative_angle` and `relative_rate` are empty with one cage, and then not among the parts.
    """

    def __init__(self, rollers: int, cages: int = 1) -> None:
        self.rollers = rollers
        self.half = half = 2 * rollers + CAGE_AND_RING + cages - 1
        first = indices_of(rollers, half)
        self.slide, self.rotation = slice(0, first.rotation), slice(first.rotation, first.cage)
        self.cage, self.ring = slice(first.cage, first.ring), slice(first.ring, first.relative_angle)
        self.slide_rate, self.spin = slice(half, first.spin), slice(first.spin, first.cage_rate)
        self.cage_rate, self.ring_rate = (
            slice(first.cage_rate, first.ring_rate),
            slice(first.ring_rate, first.relative_rate),
        )
        self.relative_angle, self.relative_rate = (
            slice(first.relative_angle, half),
            slice(first.relative_rate, 2 * half),
        )
        self.shaft_cage_rate = slice(first.ring_rate - 1, first.ring_rate)
        self.coordinates: tuple[slice, ...] = (self.slide, self.rotation, self.cage, self.ring)
        self.velocities: tuple[slice, ...] = (self.slide_rate, self.spin, self.cage_rate, self.ring_rate)
        if cages > 1:
            self.coordinates, self.velocities = (
                (*self.coordinates, self.relative_angle),
                (*self.velocities, self.relative_rate),
            )
        self.parts = self.coordinates + self.velocities


def layout_of(state: NDArray[np.float64]) -> StateLayout:
    """Layout of a state vector."""
    rollers, more = divmod(len(state) // 2 - CAGE_AND_RING, 2)
    return StateLayout(rollers, 1 + more)
