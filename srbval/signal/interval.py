"""Uncertainty of a line's frequency: the Cramer-Rao bound of noise, and a calibrated table for noise with slip."""

import functools
import importlib.resources
import math
import tomllib
from typing import Any

import numpy as np
import scipy.special

NORMAL_95 = 1.959964
WEAK_SNR = 10.0  # if the strongest harmonic is this many times its noise, phases scatter twice as far as to first order


def frequency_error_hz(information: float, seconds: float) -> float:
    """Least standard error of the frequency of a steady tone of unknown amplitude and phase in noise [Hz].

    Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591. `information` is the peak over its noise in a periodogram;
    for several tones the sum of these, each times the square of its derivative by the frequency.
    """
    return math.sqrt(6 / information) / (2 * math.pi * seconds) if information > 0 else math.inf


@functools.cache
def slip_interval() -> dict[str, Any]:
    """The calibrated table (`slip_interval.toml`).

    ``floor`` standard errors up to ``start``, from there ``factor`` times the spread, interpolated linearly between the
    knots ``log_spread`` of the weighted mean of log(1 + ratio of walk to noise). For weak lines see `weak_factor`.
    """
    file = importlib.resources.files("srbval.signal") / "slip_interval.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def walk_share(log_spread: float) -> float:
    """Clearness, from 0 to 1, of a random walk besides the noise in the residuals."""
    return -math.expm1(-(max(log_spread - slip_interval()["start"], 0.0) ** 2))


def half_width(log_spread: float, blocks: int, snr: float) -> float:
    """95 % half width in standard errors from noise, for a spread estimated from `blocks` phases of a line.

    The table is for many blocks of a strong line: the walk's share is widened by Student's t, and for a low `snr`.
    """
    table = slip_interval()
    wide = math.exp(log_spread / 2) * float(np.interp(log_spread, table["log_spread"], table["factor"]))
    own = table["floor"] if log_spread < table["start"] else max(table["floor"], wide)
    student = float(scipy.special.stdtrit(blocks - 2, 0.975)) / NORMAL_95
    return own * (1 + walk_share(log_spread) * (student * (1 + WEAK_SNR / snr) - 1))


def weak_factor(steady: float, wide: float) -> float:
    """Factor on a weak line's credible interval; `wide` is its width over noise's, `steady` the chance of no slip."""
    table = slip_interval()
    by_steady = np.interp(steady, table["weak_steady"], np.log(table["weak_factor"]))
    return math.exp(by_steady + np.interp(math.log(wide), np.log(table["wide"]), np.log(table["wide_factor"])))
