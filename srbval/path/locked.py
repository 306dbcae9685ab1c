"""Power locked to a fault: the part of a record's power in a band that repeats at each passage over the defect.

The passage period, the time from one passage of a rolling element over the defect to the next, is divided into short
cells. The squared envelope is averaged in each cell over all passages. The power that the fault adds is the mean of all
cells minus the mean of that quarter of the period in which the squared envelope is lowest; noise and tones cancel.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.reading.pipeline import choose_tracking, one_signal, process
from srbval.recordings import Recording
from srbval.signal import analytic_signal, drop_ends, end_s
from srbval.signal.locked import LockedMean, locked_mean, steady_tone

Band = TypeVar("Band", str, float)  # name of a band
SPACINGS = 2  # least width of a band, in spacings of the line: a modulation needs two lines
# Multiples of BPFO with high and narrow lines of unknown cause in the rig's records, by whether the bearing is healthy.
PASSAGE_LINES = {False: (15, 30), True: (12, 24)}
SLIP = 0.004  # largest relative distance of a line from pure rolling
HALF_OCTAVE = 10**0.15  # half width of the band in which a line is read: passages stay short in it


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
