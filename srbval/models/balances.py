"""Balances of energy and momentum over a run, which any motion of the model must keep; see `health`."""

import math
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray
from srbval.models import outputs as col


@dataclass
class EnergyBalance:
    """Work done on the bearing, losses and stored energy over a run.

    The energy stored is known at an interval's start, so the latest interval, `pending`, is left out of the sums.
    """

    work_w: float = 0.0
    lost_w: float = 0.0
    pending: tuple[float, float] = (0.0, 0.0)
    first_j: float | None = None
    last_j: float = 0.0

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows, see `outputs`."""
        work = out[:, col.DRIVE_POWER] + out[:, col.LOAD_POWER]
        lost = out[:, col.FRICTION_POWER] + out[:, col.DAMPING_POWER] + out[:, col.HOUSING_POWER]
        lost = lost + out[:, col.OIL].sum(axis=1)
        stored = out[:, col.BODY_ENERGY] + out[:, col.CONTACT_ENERGY] + out[:, col.SPRING_ENERGY]
        self.first_j = float(stored[0]) if self.first_j is None else self.first_j
        self.work_w += self.pending[0] + float(work[:-1].sum())
        self.lost_w += self.pending[1] + float(lost[:-1].sum())
        self.pending, self.last_j = (float(work[-1]), float(lost[-1])), float(stored[-1])

    def imbalance(self, interval_s: float) -> float:
        """Work in less stored less lost, as a share of what was lost; NaN where nothing was."""
        gained, lost = self.last_j - (self.first_j or 0.0), self.lost_w * interval_s
        return (self.work_w * interval_s - gained - lost) / lost if lost else math.nan


@dataclass
class MomentumBalance:
    """Forces on the outer ring over a run: rollers, load, weight, spring and damper make up its change of momentum.

    Newton's second law in the mean; what is missing is the integrator's. The first row is left out, as the ring's speed
    before it is not known. The arrays, [9]: accelerations, displacements, forces of the rollers.
    """

    mass_kg: float = math.nan
    stiffness_n_m: float = math.nan
    damping_ns_m: float = math.nan
    weight_n: float = math.nan
    rows: int = 0
    first: FloatArray = field(default_factory=lambda: np.zeros(9))
    last: FloatArray = field(default_factory=lambda: np.zeros(9))
    total: FloatArray = field(default_factory=lambda: np.zeros(9))

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows, see `outputs`."""
        rows = np.hstack([out[:, part] for part in (col.ACCELERATION, col.DISPLACEMENT, col.RING_FORCE)])
        self.first = self.first if self.rows else rows[0]
        self.rows, self.last, self.total = self.rows + len(rows), rows[-1], self.total + rows.sum(axis=0)

    def missing_n(self, load_n: FloatArray, interval_s: float) -> FloatArray:
        """Mean force on the ring beside these, under a mean external load, [3]; NaN where it is not known."""
        intervals = self.rows - 1 if self.rows > 1 else math.nan
        acceleration, displacement, rollers = np.split((self.total - self.first) / intervals, 3)
        moved = (self.last - self.first)[3:6] / intervals
        held = self.stiffness_n_m * (displacement - moved / 2) + self.damping_ns_m * moved / interval_s
        weight = np.array([0.0, -self.weight_n, 0.0])
        missing: FloatArray = rollers + load_n + weight - held - self.mass_kg * acceleration
        return missing
