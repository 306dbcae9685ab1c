"""The course of the shaft's speed from a tachometer channel: pulses, or a voltage already turned into a speed."""

import dataclasses
import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.reading import SPEED_HZ, Channel, Reading
from srbval.recordings.recording import ShaftSpeed, SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, Z95, tachometer_speed

HYSTERESIS = 0.25  # of the swing from low to high, to either side of its middle
LEAST_TURNS = 4  # for an interval and a spline
SPIKES = 2e-4  # share of the samples at either end that may be no level of the signal
ODD_INTERVAL = 0.4  # off the median of its neighbours by more: a pulse is missing, or is none
NEIGHBOURS = 2  # turns to either side
POINTS_PER_TURN = 8  # of the speed signal
AGREES = 0.1  # of the speed stated by the user: more is a wrong number of pulses per revolution


def with_tachometer(reading: Reading, channel: Channel, *, pulses_per_rev: float | None, rpm: float | None) -> Reading:
    """`reading` with the speed that `channel` shows; what is wrong with it becomes its `speed_problem`.

    A channel in rpm, Hz or rad/s is a speed, any other one pulses. `rpm` is what the user states of the mean.
    """
    name = channel.variable or ""
    fs_hz = _rate(reading, channel)
    factor = SPEED_HZ.get(channel.unit or "")
    problem = None
    if fs_hz is None:
        problem = f"tachometer {name}: its sampling rate is not known."
    elif factor is None and pulses_per_rev is None:
        problem = f"tachometer {name}: pulses per revolution of the shaft: --pulses-per-rev N."
    if problem or fs_hz is None:
        return dataclasses.replace(reading, speed=None, speed_signal=None, speed_problem=problem)
    try:
        if factor is not None:
            speed = tachometer_speed(channel.samples * factor)
            signal, said = SpeedSignal(values_hz=channel.samples * factor, rate_hz=fs_hz), "a speed signal"
        else:
            speed, signal, pulses = speed_from_pulses(channel.samples, fs_hz, pulses_per_rev or 1.0)
            said = f"{pulses} pulses, {pulses_per_rev:g} per revolution"
    except DataError as error:
        return dataclasses.replace(reading, speed=None, speed_signal=None, speed_problem=f"tachometer {name}: {error}")
    found = speed.value_hz * RPM_PER_HZ
    if rpm is not None and abs(found / rpm - 1) > AGREES:
        problem = f"tachometer {name} shows {found:.6g} rpm, stated are {rpm:g}: check --pulses-per-rev."
    note = f"speed from tachometer {name}, {said}"
    return dataclasses.replace(
        reading, speed=speed, speed_signal=signal, speed_problem=problem, notes=(*reading.notes, note)
    )


def _rate(reading: Reading, channel: Channel) -> float | None:
    """The tachometer's sampling rate [Hz]: that of the record where both have as many samples, unless the file says."""
    main = reading.channels[reading.channel] if reading.channel is not None else channel
    if channel.fs_hz and main.fs_hz and reading.fs_hz:
        return channel.fs_hz * reading.fs_hz / main.fs_hz
    return reading.fs_hz if channel.samples.size == main.samples.size else channel.fs_hz


def speed_from_pulses(samples: FloatArray, fs_hz: float, pulses_per_rev: float) -> tuple[ShaftSpeed, SpeedSignal, int]:
    """Mean speed, its course over the record, and the number of pulses, from a channel of pulses at `fs_hz` [Hz].

    A pulse counts where the signal rises through the middle of its two levels. The mean is the whole revolutions over
    their time. Its 95 % interval comes from the times of single pulses: their white error is what the second
    differences of the times of whole revolutions show (variance over 6), at least that of a sample's width
    (1 / (sqrt(12) `fs_hz`)), at both ends; and from the part of the record that no whole revolution covers, at the
    spread of the speed. Pulses and vibration have one clock, so its scale cancels in every order and is not counted.
    The course is the derivative of a cubic spline through the times of whole revolutions: errors of the disc within a
    revolution cancel. Raises `DataError` where there are too few pulses, or some are missing or too many.
    """
    from scipy.interpolate import CubicSpline

    times = pulse_times(samples) / fs_hz
    stride = max(1, round(pulses_per_rev))
    marks = times[::stride]
    if marks.size < LEAST_TURNS + 1:
        raise DataError(
            f"{times.size} pulses, {times.size / pulses_per_rev:.3g} revolutions; {LEAST_TURNS} are needed."
        )
    _check_even(times, stride)
    turns = np.arange(marks.size) * (stride / pulses_per_rev)
    seconds, covered = samples.size / fs_hz, float(marks[-1] - marks[0])
    mean = float(turns[-1]) / covered
    count = max(2, math.ceil(POINTS_PER_TURN * mean * seconds))
    at = np.linspace(0, seconds, count)
    values = CubicSpline(marks, turns)(np.clip(at, marks[0], marks[-1]), 1)
    course = tachometer_speed(values)
    jitter = max(math.sqrt(float(np.mean(np.diff(marks, 2) ** 2)) / 6), 1 / (math.sqrt(12) * fs_hz))
    ends = (1 - covered / seconds) * (course.spread_hz or 0.0)
    half = Z95 * math.hypot(math.sqrt(2) * jitter / covered * mean, ends)
    speed = dataclasses.replace(course, value_hz=mean, ci95_hz=half)
    return speed, SpeedSignal(values_hz=values, rate_hz=(count - 1) / seconds), times.size


def pulse_times(samples: FloatArray) -> FloatArray:
    """Where the signal rises through the middle between its two levels [samples], interpolated between two of them.

    A rise counts once the signal has been below and is then above the middle by `HYSTERESIS` of the swing.
    """
    middle = float(np.mean(np.quantile(samples, (SPIKES, 1 - SPIKES))))
    swing = 0.0
    for _ in range(4):  # the levels are the medians of what lies below and above; spikes do not move them
        below = samples < middle
        if not 0 < below.sum() < samples.size:
            raise DataError("a constant signal without pulses.")
        low, high = float(np.median(samples[below])), float(np.median(samples[~below]))
        middle, swing = (low + high) / 2, high - low
    sure = np.flatnonzero(np.abs(samples - middle) > HYSTERESIS * swing)
    high_there = samples[sure] > middle
    risen = sure[1:][high_there[1:] & ~high_there[:-1]]
    last_below = np.maximum.accumulate(np.where(samples < middle, np.arange(samples.size), 0))[risen]
    step = samples[last_below + 1] - samples[last_below]
    crossings: FloatArray = last_below + (middle - samples[last_below]) / step
    return crossings


def _check_even(times: FloatArray, stride: int) -> None:
    from scipy.ndimage import median_filter

    intervals = np.diff(times)
    usual = median_filter(intervals, size=min(2 * NEIGHBOURS * stride + 1, intervals.size), mode="nearest")
    odd = np.flatnonzero(np.abs(intervals / usual - 1) > ODD_INTERVAL)
    if odd.size:
        raise DataError(
            f"{odd.size} of {intervals.size} intervals between pulses differ from their neighbours by more than "
            f"{100 * ODD_INTERVAL:.0f} %, the first at {times[odd[0]]:.4g} s: pulses are missing or spurious."
        )
