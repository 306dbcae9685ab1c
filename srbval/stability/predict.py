"""Step limits of every solver in one part of the map, from the linearised system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.models.solvers import METHODS
from srbval.models.solvers.limit import longest_step
from srbval.models.solvers.linear import Linear
from srbval.models.step_limit import without_friction
from srbval.scene import Scene
from srbval.stability.linear import balanced, linearise

ANGLES = 3  # cage angles looked at, from a roller on the defect to one on either side of it; the least limit counts


@dataclass(frozen=True, kw_only=True)
class StepLimits:
    """Longest stable step [s]: of the whole linearised system, and of its elastic part alone, friction left out.

    Explicit friction does not diverge beyond its limit, it chatters between bounds; beyond the elastic limit the
    rollers are thrown about. None: no step looked at (`limit.LONGEST_S`) fails.
    """

    whole_s: float | None
    elastic_s: float | None


def predict(scene: Scene, solvers: Sequence[str]) -> dict[str, StepLimits]:
    """Step limits of each solver at `scene`'s speed, load and friction; its solver and step do not matter."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):  # small matrices: waiting for other threads takes longer than the work
        systems = [_both(scene, share) for share in np.linspace(0.0, 0.5, ANGLES)]
        return {
            solver: StepLimits(
                whole_s=_least([longest_step(METHODS[solver], whole) for whole, _ in systems]),
                elastic_s=_least([longest_step(METHODS[solver], elastic) for _, elastic in systems]),
            )
            for solver in solvers
        }


def _both(scene: Scene, pitches: float) -> tuple[Linear, Linear]:
    """The system with friction and without, the cage turned by this many roller pitches."""
    model, state = balanced(scene, pitches=pitches)
    return linearise(model, state), linearise(without_friction(model), state)


def _least(limits: Sequence[float | None]) -> float | None:
    return min((limit for limit in limits if limit is not None), default=None)
