"""Kinematics only: a click whenever a rolling element of a purely rolling bearing passes a defect.

Answers: where the fault lines are, but for slip. Cannot answer anything about heights: its clicks are all alike, of
one sample and no particular strength, so harmonics, sidebands, noise floor and amplitude mean nothing; nor slip, which
it takes to be none. A healthy bearing is silent. Needs no geometry: orders are enough.
"""

import time
from collections.abc import Iterator

import numpy as np

from srbval.models.outputs import Outputs
from srbval.models.prescribed import Prescribed, passages
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import prescribed_outputs

CLICK_M_S2 = 1.0  # of no meaning


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """The rung, see `srbval.models.ladder`. A click between two samples is shared by them, so that lines stay put."""
    started = time.perf_counter()
    scene, rate = stats.scene, stats.scene.output_rate_hz
    motion = Prescribed(scene=scene, orders=stats.bearing.orders)
    clicks = np.zeros(whole + 1)
    for defect in scene.defects:
        times = passages(defect, motion, stats.bearing.rolling_elements, scene.load.zone_rad, whole / rate)[0]
        place = times[(times >= 0) & (times * rate < whole)] * rate
        below = place.astype(np.int64)
        np.add.at(clicks, below, CLICK_M_S2 * (1 - (place - below)))
        np.add.at(clicks, below + 1, CLICK_M_S2 * (place - below))
    return prescribed_outputs(stats, settle, motion, -clicks[:whole, None] * motion.direction, started)
