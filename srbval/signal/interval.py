"""How wide an interval must be where slip may add to noise: a calibrated table, read and applied."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.special

from srbval.config.strict import build, read_toml


NORMAL_95 = 1.959964


@dataclass(frozen=True, kw_only=True)
class SlipInterval:
    """The table: `floor` noise errors up to `start`, from there `factor` times the spread, between its knots linear.

    `log_spread` are the knots, rising, of the weighted mean of log(1 + ratio of walk to noise).
    """

    floor: float
    start: float
    log_spread: tuple[float, ...]
    factor: tuple[float, ...]

    def half_width(self, log_spread: float) -> float:
        """95 % half width in units of the standard error from noise alone."""
        if log_spread < self.start:
            return self.floor
        return max(self.floor, math.exp(log_spread / 2) * float(np.interp(log_spread, self.log_spread, self.factor)))


@functools.cache
def slip_interval() -> SlipInterval:
    """The table this version was calibrated with."""
    return build(SlipInterval, read_toml(Path(__file__).with_name("slip_interval.toml")), "slip_interval.toml")


def half_width(log_spread: float, blocks: int) -> float:
    """95 % half width in noise errors; a spread told from few `blocks` is widened as Student's t would.

    The table is for many blocks; noise is known in any case, so only the walk's share is widened.
    """
    student = float(scipy.special.stdtrit(blocks - 2, 0.975)) / NORMAL_95
    walk = -math.expm1(-log_spread)
    return slip_interval().half_width(log_spread) * (1 + walk * (student - 1))
