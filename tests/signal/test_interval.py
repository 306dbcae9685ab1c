"""Intervals of a line's frequency: the least error in noise, and coverage where slip adds to it."""

import numpy as np

from srbval.signal.interval import half_width
from srbval.signal.slip import RATIOS, modes_of, weigh

BLOCKS, DRAWS = 96, 4000
# What the stated 95 % has to cover for every slip, and three standard errors of the draws at its ends.
LEAST, MOST = 0.92 - 0.013, 0.98 + 0.007


def covered(ratio, rng):
    """Share of drawn phase paths whose slope, truly zero, lies within the interval."""
    modes = modes_of(BLOCKS)
    step = np.sqrt(ratio * modes.walk_over_noise)
    phase = rng.standard_normal((DRAWS, BLOCKS)) + step * np.cumsum(rng.standard_normal((DRAWS, BLOCKS)), axis=1)
    inside = 0
    for path in phase:
        residual = modes.contrasts @ path
        weight, _ = weigh(residual, modes.share)
        slope = modes.slope @ path - modes.carried(weight) @ residual
        half = np.sqrt(modes.slope_variance) * half_width(float(weight @ np.log1p(RATIOS)), BLOCKS, np.inf)
        inside += abs(slope) < half
    return inside / DRAWS


def test_interval_covers_whatever_the_slip_is_beside_the_noise():
    """A slip as large as the noise is the hard case: neither the noise's interval nor the posterior's covers there."""
    rng = np.random.default_rng(1)
    for ratio in (0.0, 1.0, 5.0, 15.0, 50.0, 1000.0):
        assert LEAST < covered(ratio, rng) < MOST, ratio
