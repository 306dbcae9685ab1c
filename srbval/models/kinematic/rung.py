"""The kinematic rung: clicks of one sample at the passages of pure rolling."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from srbval.models.chunk import COLUMNS, Chunk
from srbval.models.passages import passages
from srbval.models.prescribed import Prescribed
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import chunks

CLICK_M_S2 = 1.0  # of no meaning


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Chunk]]:
    """The rung, see `srbval.models.ladder`. A click between two samples is shared by them, so that lines stay put."""
    started = time.perf_counter()
    scene, rate = stats.scene, stats.scene.output_rate_hz
    motion = Prescribed(scene=scene, orders=stats.bearing.orders)
    out = np.full((whole, COLUMNS), np.nan)
    clicks = np.zeros(whole + 1)
    for defect in scene.defects:
        times = passages(defect, motion, stats.bearing.rolling_elements, scene.load.zone_rad, whole / rate).time_s
        place = times[(times >= 0) & (times * rate < whole)] * rate
        below = place.astype(np.int64)
        np.add.at(clicks, below, CLICK_M_S2 * (1 - (place - below)))
        np.add.at(clicks, below + 1, CLICK_M_S2 * (place - below))
    out[:, :2] = -clicks[:whole, None] * motion.direction
    out[:, 2] = 0.0
    out[:, 6] = np.diff(motion.cage_rad(np.arange(whole + 1) / rate)) * rate
    stats.wall_s += time.perf_counter() - started
    for first, count in chunks(settle, whole, 0, rate):
        yield first, Chunk(out=out[first : first + count])
