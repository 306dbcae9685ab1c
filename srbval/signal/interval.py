"""How wide an interval must be where slip may add to noise: a calibrated table, read and applied."""

from __future__ import annotations

import functools
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.special

NORMAL_95 = 1.959964
# Where the strongest harmonic is this many times its noise, phases scatter twice as far as to first order.
WEAK_SNR = 10.0


@dataclass(frozen=True, kw_only=True)
class SlipInterval:
    """The table: `floor` noise errors up to `start`, from there `factor` times the spread, between its knots linear.

    `log_spread` are the knots, rising, of the weighted mean of log(1 + ratio of walk to noise). A weak line's credible
    interval is stretched by two factors, `weak_factor` after the chance `weak_steady` that nothing slips and
    `wide_factor` after its width in those of noise alone, `wide`.
    """

    floor: float
    start: float
    log_spread: tuple[float, ...]
    factor: tuple[float, ...]
    weak_steady: tuple[float, ...]
    weak_factor: tuple[float, ...]
    wide: tuple[float, ...]
    wide_factor: tuple[float, ...]

    def half_width(self, log_spread: float) -> float:
        """95 % half width in units of the standard error from noise alone."""
        if log_spread < self.start:
            return self.floor
        return max(self.floor, math.exp(log_spread / 2) * float(np.interp(log_spread, self.log_spread, self.factor)))


@functools.cache
def slip_interval() -> SlipInterval:
    """The table this version was calibrated with."""
    table = tomllib.loads(Path(__file__).with_name("slip_interval.toml").read_text(encoding="utf-8"))
    return SlipInterval(
        floor=table["floor"],
        start=table["start"],
        log_spread=tuple(table["log_spread"]),
        factor=tuple(table["factor"]),
        weak_steady=tuple(table["weak"]["steady"]),
        weak_factor=tuple(table["weak"]["steady_factor"]),
        wide=tuple(table["weak"]["wide"]),
        wide_factor=tuple(table["weak"]["wide_factor"]),
    )


def walk_share(log_spread: float) -> float:
    """From none to one: how far the residuals show a walk beside the noise."""
    return -math.expm1(-(max(log_spread - slip_interval().start, 0.0) ** 2))


def half_width(log_spread: float, blocks: int, snr: float) -> float:
    """95 % half width in noise errors, for a spread told from `blocks` phases of a line `snr` times its noise.

    The table is for many blocks of a strong line, and noise alone needs no more. The walk's share is widened as
    Student's t asks for few blocks, and for a weak line, whose phases scatter by more than to first order (simulated).
    """
    student = float(scipy.special.stdtrit(blocks - 2, 0.975)) / NORMAL_95
    wider = student * (1 + WEAK_SNR / snr) - 1
    return slip_interval().half_width(log_spread) * (1 + walk_share(log_spread) * wider)


def weak_factor(steady: float, wide: float) -> float:
    """How many times its credible interval a weak line needs to be covered.

    `steady` is the chance that nothing slips, `wide` the interval's width over that of noise alone.
    """
    table = slip_interval()
    by_steady = np.interp(steady, table.weak_steady, np.log(table.weak_factor))
    return math.exp(by_steady + np.interp(math.log(wide), np.log(table.wide), np.log(table.wide_factor)))
