"""Power locked to a fault: the part of a record's power in a band that repeats at each passage over the defect.

The passage period, the time from one passage of a rolling element over the defect to the next, is divided into short
cells. The squared envelope is averaged in each cell over all passages. The power that the fault adds is the mean of all
cells minus the mean of that quarter of the period in which the squared envelope is lowest; noise and tones cancel.
This quarter is found in every second period, and the mean is computed in the other periods, and vice versa: the least
of many noisy means is biased low.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import scipy.special  # scipy.signal takes half a second: scipy loads it at its first use

from srbval.arrays import ComplexArray, FloatArray
from srbval.bearing import Bearing, Fault
from srbval.errors import DataError
from srbval.reading.pipeline import choose_tracking, one_signal, process
from srbval.recordings import Recording
from srbval.signal import analytic_signal, drop_ends, end_s

Band = TypeVar("Band", str, float)  # name of a band
SPACINGS = 2  # least width of a band, in spacings of the line: a modulation needs two lines
# Multiples of BPFO with high and narrow lines of unknown cause in the rig's records, by whether the bearing is healthy.
PASSAGE_LINES = {False: (15, 30), True: (12, 24)}
SLIP = 0.004  # largest relative distance of a line from pure rolling
HALF_OCTAVE = 10**0.15  # half width of the band in which a line is read: passages stay short in it
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
    return min(found, key=lambda one: one[0])[1:]


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


def locked_powers(
    recording: Recording, bearing: Bearing, found_order: float, bands_hz: Mapping[Band, tuple[float, float]]
) -> dict[Band, LockedMean]:
    """Power in each band that repeats `found_order` times per turn; bands narrower than twice this rate are omitted."""
    speed = recording.known_speed
    tracking = choose_tracking(recording, bearing, speed)
    line_hz, found = found_order * speed.value_hz, {}
    for name, band_hz in bands_hz.items():
        if band_hz[1] - band_hz[0] >= SPACINGS * line_hz:
            processed = process(recording, band_hz=band_hz, tracking=tracking)
            power = processed.squared * processed.scale**2 / 2  # of a real signal, half its analytic signal's
            if recording.interval_means:
                power /= np.sinc(math.sqrt(band_hz[0] * band_hz[1]) / recording.fs_hz) ** 2
            periods: FloatArray = line_hz / processed.squared_fs_hz * np.arange(power.size, dtype=float)
            cage_turns = int(processed.seconds * bearing.orders.ftf * speed.value_hz)
            found[name] = locked_mean(power, periods, cage_turns)
    return found


def without_passage_lines(
    recording: Recording, bearing: Bearing, found_order: float | None, within_hz: tuple[float, float]
) -> Recording:
    """Remove steady tones, known from Giraudo's rig, at multiples of BPFO; impacts, `found_order` a turn, are kept."""
    speed = recording.known_speed
    course = choose_tracking(recording, bearing, speed).course
    at_s = np.arange(recording.samples) / recording.fs_hz
    turns = speed.value_hz * at_s if course is None else course.turns_at(at_s)
    signal, fs_hz = one_signal(recording), recording.fs_hz
    for multiple in PASSAGE_LINES[recording.state is Fault.HEALTHY]:
        order = multiple * bearing.orders.bpfo
        if within_hz[0] < order * speed.value_hz < within_hz[1]:
            band_hz = (order * speed.value_hz / HALF_OCTAVE, order * speed.value_hz * HALF_OCTAVE)
            kept = drop_ends(turns, fs_hz, end_s(band_hz)).size
            first = (signal.size - kept) // 2
            inside = slice(first, first + kept)
            periods = None if found_order is None else found_order * turns[inside]
            analytic = analytic_signal(signal, fs_hz, band_hz)[inside]
            reach = SLIP * (order * speed.value_hz) * kept / fs_hz
            amplitude, slip = steady_tone(analytic, (order * turns)[inside], periods, reach)
            slipped = slip * (np.arange(signal.size) - first) / kept
            signal = signal - (amplitude * np.exp(2j * np.pi * (order * turns + slipped))).real
    return replace(recording, channels={"sensor": signal}, channel="sensor", axes=None)
