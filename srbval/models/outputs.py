"""Outputs of a model: the column of each quantity, and the division of a run into chunks of output intervals.

`srbval.models.run.Run` has a named property for each quantity of interest to users.
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
    MEAN_RING_FORCE_X, MEAN_RING_FORCE_Y, MEAN_RING_FORCE_Z,  # force of the rollers on the outer ring, mean [N]
    MAX_PENETRATION,  # deepest penetration [m]
    MEAN_DRIVE_POWER, MEAN_LOAD_POWER,  # mean power of the drive, of the external load [W]
    MEAN_FRICTION_POWER, MEAN_DAMPING_POWER, MEAN_HOUSING_POWER,  # lost to friction, contact damping, the housing [W]
    BODY_ENERGY_AT_START, CONTACT_ENERGY_AT_START, SPRING_ENERGY_AT_START,  # of bodies, contacts, housing spring [J]
    MEAN_ROLLING_POWER, MEAN_DRAG_POWER, MEAN_POCKET_POWER,  # lost to rolling resistance, drag, pockets [W]; 0: no oil
) = range(24)  # fmt: skip
COLUMN_COUNT = 24

ACCELERATION_XYZ, DISPLACEMENT_XYZ = slice(0, 3), slice(3, 6)
CAGE_TILT_XY, MEAN_RING_FORCE_XYZ = slice(7, 9), slice(9, 12)
OIL_LOSSES = slice(21, 24)

DEPTH_LIMIT_M = 2e-4  # highest penetration at which the search finds every touching point; checked in each run
CHUNK_S = 0.02  # simulated time between two reports of progress
CHUNK_STEPS = 500_000  # highest number of steps in a chunk; a run can only be interrupted between chunks


@dataclass(frozen=True, kw_only=True, eq=False)
class Outputs:
    """Outputs of a run or of a part of it: `out` has a row for each output interval and a column for each quantity.

    A column is NaN if the model does not compute the quantity. Detailed outputs, if any, are `spin_rad_s`, spins of the
    rollers, [k, rollers], and `load_n`, normal forces, [k, 2 races, rollers, 3 contact circles], at k times.
    `sensor_m_s2` is the acceleration at the sensor in each interval, if the scene has a path to the sensor.
    """

    out: FloatArray
    spin_rad_s: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    load_n: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 0, 3)))
    sensor_m_s2: FloatArray = field(default_factory=lambda: np.zeros(0))


def split_run(settle: int, whole: int, per_detail: int, rate_hz: float, steps: int = 1) -> Iterator[tuple[int, int]]:
    """Divide a run of `whole` intervals into chunks: yields the first interval and the number of intervals of each.

    No chunk extends over the end of the first `settle` intervals, which are not recorded. Later chunks begin with
    detailed outputs (see `Outputs`), which are `per_detail` intervals apart (0: none). A chunk is about `CHUNK_S` long,
    or shorter if this takes more than `CHUNK_STEPS` solver steps. `rate_hz`: intervals per second; `steps`: solver
    steps per interval.
    """
    length = max(1, min(round(CHUNK_S * rate_hz), CHUNK_STEPS // steps))
    if per_detail:
        length = -(-length // per_detail) * per_detail
    for start, end in ((0, settle), (settle, whole)):
        for first in range(start, end, length):
            yield first, min(length, end - first)
