"""Mean frequency of a line that may slip, and its interval from noise and slip; error of a steady line's frequency."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal.periodogram import Phasors
from srbval.signal.phase_posterior import posterior

NORMAL_95 = 1.959964
# Numbers of blocks; the largest that the record and its sidebands allow is used. Blocks last at least two periods of
# the modulation, or one if fewer than `FEW_BLOCKS` of two fit: fewer phases do not distinguish slip from noise.
BLOCK_NUMBERS, FEW_BLOCKS = (32, 24, 16, 12, 8, 6, 5, 4), 8
MIN_SLIP_SNR = 8.0  # power over noise of the strongest harmonic below which slip is not estimated
# Most information of all harmonics about the phase, sum h^2 rho: the noise of a stronger line is assumed to be higher,
# so that the grid of phases resolves the line's phase in each block.
MOST_INFORMATION = 2000.0
LEAST_NOISE = 1e-12  # least noise power in a bin, relative to the line's power
# Half width of the stated interval over that of the credible interval, which contains the frequency in fewer than 95 %
# of cases if a line slips about as much as noise lets its phase scatter: from simulated combs (`studies/reading`).
WIDENING = 1.8


def frequency_error_hz(information: float, seconds: float) -> float:
    """Least standard error of the frequency of a steady tone of unknown amplitude and phase in noise [Hz].

    Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591. `information` is the tone's peak in a periodogram divided by
    the noise there; for a tone with harmonics h it is the sum of h^2 times each harmonic's peak over noise.
    """
    return math.sqrt(6 / information) / (2 * math.pi * seconds) if information > 0 else math.inf


def track_slip(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, line_hz: float, period_s: float = 0.0
) -> tuple[float, float] | None:
    """Shift from `line_hz` of the mean frequency of a line that may slip, and its 95 % half width [Hz].

    Component c of `phasors` is harmonic `number[c]`, with `noise_power[c]` in a bin; `period_s` is the period of the
    line's amplitude modulation by the shaft (0: none). The shift is the mean of the frequency's posterior, the half
    width `WIDENING` times that of its credible interval (`phase_posterior`). None if the line is too weak; the half
    width is infinite for too few blocks to estimate slip.
    """
    # Without noise, any slip would be certain.
    noise_power = np.maximum(noise_power, LEAST_NOISE * float(np.max(phasors.power())))
    if float(np.max(phasors.power() / noise_power)) < MIN_SLIP_SNR:
        return None
    shortest_s = period_s * (2 if phasors.seconds >= 2 * FEW_BLOCKS * period_s else 1)
    most = min(phasors.sums.shape[1], phasors.seconds / shortest_s if shortest_s else math.inf)
    blocks = next((count for count in BLOCK_NUMBERS if count <= most), None)
    if blocks is None:
        return 0.0, math.inf
    first = np.linspace(0, phasors.sums.shape[1], blocks + 1).astype(int)[:-1]
    sums = np.add.reduceat(phasors.sums, first, axis=1) * np.sqrt(blocks / noise_power)[:, None]
    information = float(number**2 @ np.maximum(np.sum(np.abs(sums) ** 2, axis=1) - blocks, 0))
    sums *= math.sqrt(min(1.0, MOST_INFORMATION / max(information, 1.0)))
    shift_hz, credible_hz = posterior(sums, number, line_hz=line_hz, block_s=phasors.seconds / blocks)
    return shift_hz, WIDENING * credible_hz
