"""Shaft speed: stated, a set point, or measured by a tachometer whose channel contains a speed or pulses."""

import dataclasses
import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import Origin, ShaftSpeed, SpeedSignal, SpeedSource

RPM_PER_HZ = 60.0
Z95 = 1.96
STATED_CI95_RPM = 1.0  # a speed in a file or given by the user counts as rounded to about 1 rpm
MIN_TACHOMETER_SAMPLES = 8
LIMIT_HZ = 2000.0  # above the speed of any rolling bearing
# Scale error of the speed by a counting tachometer (95 %): quartz clocks of tachometer and recorder, 50 parts in a
# million each, with a margin for temperature and age. An assumption; an analogue tachometer may be worse.
SCALE_CI95 = 1e-4
MOST_TOLERANCE_PCT = 10.0  # the widest search for the speed in a record
HYSTERESIS = 0.25  # of the swing from low to high, to either side of its middle
LEAST_TURNS = 4  # for an interval and a spline
SPIKES = 2e-4  # share of the highest and of the lowest samples that is ignored
ODD_INTERVAL = 0.4  # largest relative deviation from the neighbours; beyond, a pulse is missing or spurious
NEIGHBOURS = 2  # turns on each side
POINTS_PER_TURN = 8  # of the speed signal
AGREES = 0.1  # largest deviation from the stated speed; beyond, the pulses per revolution are wrong


def tachometer_speed(speed_hz: FloatArray, rate_hz: float | None = None) -> ShaftSpeed:
    """Mean of a speed signal [Hz] sampled at `rate_hz`, with 95 % interval, drift and standard deviation.

    The interval combines errors of the clocks of tachometer and recorder (`SCALE_CI95`), white noise (its variance is a
    sixth of the mean square of the signal's second differences) and, if `rate_hz` is given, errors of the shaft angle
    at the signal's start and end (`turn_error_s`). Raises `DataError` if the signal cannot be a shaft speed.
    """
    if speed_hz.size < MIN_TACHOMETER_SAMPLES:
        raise DataError(f"speed signal of {speed_hz.size} samples; {MIN_TACHOMETER_SAMPLES} are needed.")
    mean = float(np.mean(speed_hz))
    if not 0 < abs(mean) < LIMIT_HZ:
        found = f"the mean of the speed signal is {mean * RPM_PER_HZ:.6g} rpm"
        raise DataError(
            f"{found}; its magnitude must be above 0 and below {LIMIT_HZ * RPM_PER_HZ:.0f} rpm: check the unit."
        )
    quarter = speed_hz.size // 4
    drift = float(np.mean(speed_hz[-quarter:]) - np.mean(speed_hz[:quarter]))
    sign = math.copysign(1.0, mean)  # fault lines do not depend on the direction of rotation
    noise = Z95 * math.sqrt(float(np.mean(np.diff(speed_hz, 2) ** 2)) / 6 / speed_hz.size)
    ends = 0.0 if rate_hz is None else Z95 * math.sqrt(2) * turn_error_s(speed_hz, rate_hz) * mean * rate_hz
    return ShaftSpeed(
        value_hz=abs(mean),
        ci95_hz=math.hypot(noise, ends / speed_hz.size, SCALE_CI95 * mean),
        source=SpeedSource.TACHOMETER,
        drift_hz=sign * drift,
        spread_hz=float(np.std(speed_hz)),
    )


def turn_error_s(speed_hz: FloatArray, rate_hz: float) -> float:
    """Standard deviation of errors in the times at which a speed signal completes revolutions [s].

    It is 0 below `LEAST_TURNS` revolutions, too large if the speed changes between revolutions, and too small if the
    sensor averages over several revolutions.
    """
    turns = np.abs(np.concatenate(([0.0], np.cumsum((speed_hz[1:] + speed_hz[:-1]) / 2) / rate_hz)))
    marks = np.interp(np.arange(math.floor(turns[-1]) + 1), turns, np.arange(turns.size) / rate_hz)
    return _white_error(marks) if marks.size > LEAST_TURNS else 0.0


def _white_error(times_s: FloatArray) -> float:
    """Standard deviation [s] of independent errors in evenly spaced times, estimated from second differences."""
    return math.sqrt(float(np.mean(np.diff(times_s, 2) ** 2)) / 6)


def prescribed_speed(value_hz: float) -> ShaftSpeed:
    """Speed at which a simulation drives the shaft [Hz], known exactly."""
    return ShaftSpeed(value_hz=value_hz, ci95_hz=0.0, source=SpeedSource.PRESCRIBED)


def nominal_speed(rpm: float, ci95_pct: float) -> ShaftSpeed:
    """Shaft speed from a set point [rpm], with the half width of the 95 % interval in per cent."""
    return stated_speed(rpm, rpm * ci95_pct / 100, SpeedSource.NOMINAL)


def stated_speed(rpm: float, ci95_rpm: float = STATED_CI95_RPM, source: SpeedSource = SpeedSource.STATED) -> ShaftSpeed:
    """Speed stated by a file or a user [rpm], with the half width of its 95 % interval [rpm]."""
    if not 0 < rpm < LIMIT_HZ * RPM_PER_HZ:
        raise DataError(f"shaft speed {rpm} rpm must be above 0 and below {LIMIT_HZ * RPM_PER_HZ:.0f}.")
    return ShaftSpeed(value_hz=rpm / RPM_PER_HZ, ci95_hz=ci95_rpm / RPM_PER_HZ, source=source)


def speed_from_user(rpm: float, tolerance_pct: float | None, reading: Reading) -> tuple[ShaftSpeed, str]:
    """Shaft speed from the user's `rpm` (a set point, a prescribed or a measured speed), and its source in words."""
    own = reading.speed
    if tolerance_pct is not None:
        return nominal_speed(rpm, tolerance_pct), f", a set point kept within {tolerance_pct:g} %"
    if reading.origin is Origin.SIMULATED:
        return prescribed_speed(rpm / RPM_PER_HZ), ", at which the simulation drives the shaft"
    if own is not None and own.source is SpeedSource.NOMINAL and abs(rpm - 60 * own.value_hz) < STATED_CI95_RPM:
        return own, f", the set point that the file states: kept within {100 * own.ci95_hz / own.value_hz:.2g} %"
    if MOST_TOLERANCE_PCT * rpm < 100 * STATED_CI95_RPM:
        raise ConfigurationError(
            f"--rpm {rpm:g} is taken as accurate to {STATED_CI95_RPM:g} rpm, more than {MOST_TOLERANCE_PCT:g} % of it; "
            "state how far the true speed may differ with --rpm-tolerance PCT."
        )
    return stated_speed(rpm), ""


def with_tachometer(reading: Reading, channel: Channel, *, pulses_per_rev: float | None, rpm: float | None) -> Reading:
    """Set the speed of `reading` from the tachometer's `channel`; if this fails, set `speed_problem` to the reason.

    A channel in Hz contains a speed, a channel in rev an angle without jumps, any other channel pulses. It has the
    record's sampling rate if both have the same number of samples, unless the file states another rate. If `rpm`, the
    mean speed stated by the user or by the file's name, disagrees, this is a `speed_problem` as well.
    """
    name, problem, main = channel.variable or "", None, reading.main
    if channel.fs_hz and main.fs_hz and reading.fs_hz:
        fs_hz: float | None = channel.fs_hz * reading.fs_hz / main.fs_hz
    else:
        fs_hz = reading.fs_hz if channel.samples.size == main.samples.size else channel.fs_hz
    try:
        if fs_hz is None:
            raise DataError("the file states no sampling rate for the tachometer channel; store it in the file.")
        if channel.rotates:
            values_hz = channel.samples if channel.unit == "Hz" else np.gradient(channel.samples) * fs_hz
            signal, said = SpeedSignal(values_hz=values_hz, rate_hz=fs_hz), "a speed signal"
            speed = tachometer_speed(signal.values_hz, signal.rate_hz)
        elif pulses_per_rev is None:
            raise DataError("the number of pulses per shaft revolution is not stated: --pulses-per-rev N.")
        else:
            speed, signal, pulses = speed_from_pulses(channel.samples, fs_hz, pulses_per_rev)
            said = f"{pulses} pulses, {pulses_per_rev:g} per revolution"
    except DataError as error:
        return dataclasses.replace(reading, speed=None, speed_signal=None, speed_problem=f"tachometer {name}: {error}")
    found = speed.value_hz * RPM_PER_HZ
    if rpm is not None and abs(found / rpm - 1) > AGREES:
        problem = f"tachometer {name} measures {found:.6g} rpm, but {rpm:g} rpm are stated"
        problem += ": check --pulses-per-rev or the unit."
    if reading.origin is Origin.SIMULATED and channel.rotates:  # exact
        speed = dataclasses.replace(speed, ci95_hz=0.0, source=SpeedSource.PRESCRIBED)
    notes = (*reading.notes, f"speed from tachometer {name}, {said}")
    return dataclasses.replace(reading, speed=speed, speed_signal=signal, speed_problem=problem, notes=notes)


def speed_from_pulses(samples: FloatArray, fs_hz: float, pulses_per_rev: float) -> tuple[ShaftSpeed, SpeedSignal, int]:
    """Mean speed, speed signal and number of pulses, from a channel of pulses sampled at `fs_hz`.

    The mean is the number of whole revolutions divided by their duration. Its 95 % interval combines the random error
    of the first and last pulse (at least 1 / (sqrt(12) `fs_hz`)) with the speed's standard deviation times the share of
    the record before the first and after the last whole revolution. Pulses and vibration have one clock, whose errors
    cancel in every order. The speed signal is the derivative of a cubic spline through the times of whole revolutions,
    so uneven spacing of the shaft's marks cancels. Raises `DataError` for too few, missing or spurious pulses.
    """
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import median_filter

    times = pulse_times(samples) / fs_hz
    stride = max(1, round(pulses_per_rev))
    marks = times[::stride]
    if marks.size < LEAST_TURNS + 1:
        found = f"{times.size} pulses, {pulses_per_rev:g} per turn, are {times.size / pulses_per_rev:.3g} turns"
        raise DataError(f"{found} of the shaft; {LEAST_TURNS} are needed: use more samples, or check --pulses-per-rev.")
    intervals = np.diff(times)
    usual = median_filter(intervals, size=min(2 * NEIGHBOURS * stride + 1, intervals.size), mode="nearest")
    odd = np.flatnonzero(np.abs(intervals / usual - 1) > ODD_INTERVAL)
    if odd.size:
        raise DataError(
            f"{odd.size} of {intervals.size} intervals between pulses differ from their neighbours by more than "
            f"{100 * ODD_INTERVAL:.0f} %, the first at {times[odd[0]]:.4g} s: pulses are missing or spurious."
        )
    turns = np.arange(marks.size) * (stride / pulses_per_rev)
    seconds, covered = samples.size / fs_hz, float(marks[-1] - marks[0])
    mean = float(turns[-1]) / covered
    count = max(2, math.ceil(POINTS_PER_TURN * mean * seconds))
    at = np.linspace(0, seconds, count)
    values = CubicSpline(marks, turns)(np.clip(at, marks[0], marks[-1]), 1)
    course = tachometer_speed(values)
    jitter = max(_white_error(marks), 1 / (math.sqrt(12) * fs_hz))
    ends = (1 - covered / seconds) * (course.spread_hz or 0.0)
    half = Z95 * math.hypot(math.sqrt(2) * jitter / covered * mean, ends)
    speed = dataclasses.replace(course, value_hz=mean, ci95_hz=half)
    return speed, SpeedSignal(values_hz=values, rate_hz=(count - 1) / seconds), times.size


def pulse_times(samples: FloatArray) -> FloatArray:
    """Times [samples] at which the signal rises through the middle of its two levels; `HYSTERESIS` rejects noise."""
    middle = float(np.mean(np.quantile(samples, (SPIKES, 1 - SPIKES))))
    swing = 0.0
    for _ in range(4):  # the levels are the medians below and above; spikes do not move them
        below = samples < middle
        if not 0 < below.sum() < samples.size:
            raise DataError("the tachometer signal is constant, without pulses; choose another channel with --tacho.")
        low, high = float(np.median(samples[below])), float(np.median(samples[~below]))
        middle, swing = (low + high) / 2, high - low
    sure = np.flatnonzero(np.abs(samples - middle) > HYSTERESIS * swing)
    high_there = samples[sure] > middle
    risen = sure[1:][high_there[1:] & ~high_there[:-1]]
    last_below = np.maximum.accumulate(np.where(samples < middle, np.arange(samples.size), 0))[risen]
    step = samples[last_below + 1] - samples[last_below]
    return np.asarray(last_below + (middle - samples[last_below]) / step)
