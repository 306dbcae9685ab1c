"""Outputs of a model in chunks of output intervals, and the columns of their quantities.

`srbval.models.run.Run` gives the columns their names for users.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray

(
    ACCELERATION_X, ACCELERATION_Y, ACCELERATION_Z,  # of the outer ring, change of velocity over the interval [m/s2]
    DISPLACEMENT_X, DISPLACEMENT_Y, DISPLACEMENT_Z,  # of the outer ring at its end [m]
    CAGE_SPEED,  # mean [rad/s]
    CAGE_TILT_X, CAGE_TILT_Y,  # at its end [rad]
    RING_FORCE_X, RING_FORCE_Y, RING_FORCE_Z,  # force of the rollers on the outer ring, mean [N]
    DEEPEST,  # deepest penetration [m]
    DRIVE_POWER, LOAD_POWER,  # mean power of the drive, of the external load [W]
    FRICTION_POWER, DAMPING_POWER, HOUSING_POWER,  # mean power lost to friction, contact damping, housing damper [W]
    BODY_ENERGY, CONTACT_ENERGY, SPRING_ENERGY,  # at its start: bodies, contacts (first evaluation), housing spring [J]
    ROLLING_POWER, DRAG_POWER, POCKET_POWER,  # mean power lost to rolling resistance, drag, pockets [W]; 0 without oil
) = range(24)  # fmt: skip
COUNT = 24

ACCELERATION, DISPLACEMENT = slice(0, 3), slice(3, 6)
CAGE_TILT, RING_FORCE = slice(7, 9), slice(9, 12)
ENERGY = slice(13, 24)  # powers and energies, in the order of `run.EnergyFlow`
OIL = slice(21, 24)

DEEPEST_M = 2e-4  # penetration within which every touching point is among the candidates; checked in each run
CHUNK_S = 0.02  # simulated time between two reports of progress
CHUNK_STEPS = 500_000  # at most; a run can be interrupted between two chunks only


@dataclass(frozen=True, kw_only=True, eq=False)
class Outputs:
    """`out`, one row per output interval, by the columns above; a column of NaN is a quantity the model does not have.

    Of the detailed outputs, if any: roller spins, [k, 2 M], and normal forces, [k, 2 races, 2 M rollers, 3 circles].
    `sensor_m_s2`: acceleration at the sensor, one value a row, if the scene has a path to it.
    """

    out: FloatArray
    spin_rad_s: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    load_n: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 0, 3)))
    sensor_m_s2: FloatArray = field(default_factory=lambda: np.zeros(0))


def chunks(settle: int, whole: int, per_detail: int, rate_hz: float, steps: int = 1) -> Iterator[tuple[int, int]]:
    """First interval, of so many `steps`, and length of each chunk.

    A chunk ends with settling; details fall on a chunk's start.
    """
    length = max(1, min(round(CHUNK_S * rate_hz), CHUNK_STEPS // steps))
    if per_detail:
        length = -(-length // per_detail) * per_detail
    first = 0
    while first < whole:
        end = settle if first < settle else whole
        count = min(length, end - first)
        yield first, count
        first += count
