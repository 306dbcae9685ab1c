"""Rise of a signal at each passage of a rolling element over a defect, and fit of a steady tone in the signal.

A passage period is the time from one passage of a rolling element over the defect to the next. The level between
passages is the mean in that quarter of the period in which the signal is lowest. This quarter is found in every second
period, and the mean is computed in the other periods, and vice versa: the least of many noisy means is biased low.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.special  # scipy.signal takes half a second: scipy loads it at its first use

from srbval.arrays import ComplexArray, FloatArray
from srbval.errors import DataError

PHASE_CELLS, QUARTER_CELLS = 48, 12
TONE_PADDING = 16  # of a tone's spectrum: between two lines the phase is wrong by at most 0.1
MIN_JACKKNIFE_BLOCKS = 4
LEAST_PASSAGES = 4 * MIN_JACKKNIFE_BLOCKS  # two in each block of either half


@dataclass(frozen=True, kw_only=True)
class LockedMean:
    """Rise of a signal's mean above its level between passages of rolling elements over a defect, in the signal's unit.

    `u` is the standard deviation of `value` by the jackknife over `blocks` successive parts (Efron & Stein 1981).
    """

    value: float
    u: float
    blocks: int

    @property
    def ci95(self) -> float:
        """Half width of the 95 % interval of `value`, by Student's t; a `value` below it is not significant."""
        return float(scipy.special.stdtrit(self.blocks - 1, 0.975)) * self.u


def locked_mean(samples: FloatArray, periods: FloatArray, blocks: int) -> LockedMean:
    """Rise of the mean of `samples` [n] above their level between passages over a defect (see `LockedMean`).

    `periods` [n] is the number of passages of rolling elements over the defect up to each sample, `blocks` the number
    of independent parts of the record. Raises `DataError` for fewer than `LEAST_PASSAGES` passages.
    """
    if periods[-1] - periods[0] < LEAST_PASSAGES:
        raise DataError(
            f"the record contains {periods[-1] - periods[0]:.3g} passages over the defect; {LEAST_PASSAGES} are needed "
            "to average over them. Use a longer recording."
        )
    count = max(blocks, MIN_JACKKNIFE_BLOCKS)
    parts = np.array_split(np.arange(samples.size), count)
    without = np.array([_less_quiet(np.delete(samples, part), np.delete(periods, part)) for part in parts])
    u = math.sqrt((count - 1) * float(np.var(without)))
    return LockedMean(value=_less_quiet(samples, periods), u=u, blocks=count)


def steady_tone(
    analytic: ComplexArray, tone: FloatArray, periods: FloatArray | None, slip: float
) -> tuple[complex, float]:
    """Fit A exp(2 pi i (`tone` + s k / n)) to samples k of an analytic signal [n]; returns amplitude A and slip s.

    `tone` [n] is the expected phase of the tone, in turns of 2 pi; s is at most `slip` turns. If `periods` [n], the
    number of passages over a defect up to each sample, is given, the tone is fitted in only one quarter of the time
    from passage to passage, the quarter with the least residual.
    """
    turned = analytic * np.exp(-2j * np.pi * tone)
    cells = np.zeros(turned.size, dtype=int) if periods is None else _cells(periods)
    slips, found = np.linspace(-slip, slip, 2 * math.ceil(TONE_PADDING * slip) + 1), []
    for start in range(0, PHASE_CELLS, QUARTER_CELLS // 4) if periods is not None else (0,):
        quarter = (cells - start) % PHASE_CELLS < QUARTER_CELLS
        inside, count = np.where(quarter, turned, 0.0), np.count_nonzero(quarter)
        near = scipy.signal.zoom_fft(inside, [-slip, slip], slips.size, fs=inside.size, endpoint=True) / count
        place = int(np.argmax(np.abs(near)))
        left = float(np.sum(np.abs(inside) ** 2)) / count - abs(near[place]) ** 2
        found.append((left, complex(near[place]), float(slips[place])))
    _, amplitude, slipped = min(found, key=lambda one: one[0])
    return amplitude, slipped


def _less_quiet(samples: FloatArray, periods: FloatArray) -> float:
    means, even = [], np.floor(periods) % 2 == 0
    for own in (even, ~even):  # means over each quarter of the phase, [CELLS], by the cell in which it begins
        cells = _cells(periods[own])
        sums, counts = np.bincount(cells, samples[own], PHASE_CELLS), np.bincount(cells, minlength=PHASE_CELLS)
        both = np.cumsum(np.column_stack((np.zeros((2, 1)), np.tile((sums, counts), 2))), axis=1)
        inside = both[:, QUARTER_CELLS : QUARTER_CELLS + PHASE_CELLS] - both[:, :PHASE_CELLS]
        means.append(inside[0] / inside[1])
    one, other = means
    return float(samples.mean() - (one[np.argmin(other)] + other[np.argmin(one)]) / 2)


def _cells(periods: FloatArray) -> np.ndarray:
    return np.floor(periods % 1.0 * PHASE_CELLS).astype(int) % PHASE_CELLS
