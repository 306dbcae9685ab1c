"""Preparation of simulated signals: cut the start, resample uneven times, differentiate to accelerations."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.raw import MIN_SAMPLES
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.units import ACCELERATION_UNIT, REVOLUTIONS, SI_FACTORS, SPEED_HZ, UNITS, known_unit, split_unit

PASSED, STOPPED = 0.4, 0.5  # shares of the sampling rate: unchanged below the first, zero above the second
STOPPED_DB = 80.0
# Longest step, in periods of the band's upper edge: a cubic spline through four samples per period of a sine has an
# error of 1.5 %. Without a band, the highest frequency that is kept needs two samples per period.
LONGEST_STEP, LONGEST_WITHOUT_BAND = 1 / 4, 1 / 2
CUBIC, QUINTIC = 3, 5  # degrees of splines; their difference estimates the error of the first
FINE_SAMPLES_PER_STEP = 4  # samples of the fine grid in a usual step
MOST_SAMPLES = 8  # after resampling, per sample in the file
SAME_TIME = 0.01  # of a new step: closer values are averaged, because their rounding would become a slope
LARGE_ERROR = 0.01  # of the RMS in the band
MIRRORED = 4096  # length of the mirror image that extends a signal at each end [samples]


def without_settling(path: Path, reading: Reading, times_s: FloatArray, skip_s: float) -> Reading:
    """Cut the first `skip_s` seconds off all channels sampled at `times_s`; `DataError` if too little remains."""
    first, signal = int(np.searchsorted(times_s, times_s[0] + skip_s)), reading.speed_signal
    if times_s.size - first < MIN_SAMPLES:
        raise DataError(
            f"{path}: the record lasts {times_s[-1] - times_s[0]:.6g} s; without the first {skip_s:g} s (--skip) "
            f"{times_s.size - first} samples remain, and {MIN_SAMPLES} are needed. Skip less."
        )
    if signal is not None:
        signal = replace(signal, values_hz=signal.values_hz[round(skip_s * signal.rate_hz) :])
    notes = (*reading.notes, f"without the first {skip_s:g} s")
    return replace(reading.with_samples(lambda samples: samples[first:]), speed_signal=signal, notes=notes)


def as_rotation(path: Path, channel: Channel) -> Channel:
    """Convert a channel to a speed [Hz] or to an angle without jumps [rev]; `DataError` if its unit fits neither."""
    name = channel.variable or ""
    behind = known_unit(split_unit(name)[1] or name.rpartition("_")[2])
    unit = channel.unit if channel.rotates else behind
    if unit in SPEED_HZ:
        return replace(channel, samples=channel.samples * SPEED_HZ[unit], unit="Hz")
    if unit in REVOLUTIONS:
        return replace(channel, samples=np.unwrap(channel.samples * REVOLUTIONS[unit], period=1.0), unit="rev")
    raise DataError(
        f"{path}: {name} must be an angle or a speed; its unit is {channel.unit or 'not stated'} instead of one of "
        f"{', '.join((*REVOLUTIONS, *SPEED_HZ))}. State it in the name, as in 'cage [rad]' or 'cage_rad_s'."
    )


def mean_hz(path: Path, rotation: Channel, times_s: FloatArray) -> float:
    """Mean frequency of a rotation [Hz], positive: mean of a speed, or slope of the line fitted to an angle."""
    if (count := rotation.samples.size) != times_s.size:
        raise DataError(f"{path}: {rotation.variable} has {count} samples instead of the vibration's {times_s.size}.")
    if rotation.unit == "Hz":
        return abs(float(np.trapezoid(rotation.samples, times_s) / (times_s[-1] - times_s[0])))
    return abs(float(np.polynomial.polynomial.polyfit(times_s - np.mean(times_s), rotation.samples, 1)[1]))


def resample_channels(
    path: Path, reading: Reading, times_s: FloatArray, fs_hz: float, derivatives: Mapping[str, int]
) -> Reading:
    """Resample all channels sampled at `times_s` to `fs_hz`, and estimate the error for the channel to analyse.

    The error is the RMS difference between cubic and quintic splines divided by the signal's RMS in the demodulation
    band. For velocities and displacements it is the error of the acceleration (`derivatives` maps units to orders of
    derivative). Raises `DataError` if a time step is too long, or if `fs_hz` is too low or too high.
    """
    main, band_hz = reading.main, reading.main.band_hz
    cautions, order = _check_steps(path, times_s, fs_hz, band_hz), derivatives.get(main.recording_unit, 0)
    changed = reading.with_samples(lambda samples: resample(times_s, samples, fs_hz), fs_hz=None)
    cubic = differentiate(changed.main.samples, fs_hz, order)
    quintic = differentiate(resample(times_s, main.samples, fs_hz, QUINTIC), fs_hz, order)
    low_hz, high_hz = band_hz or (0.0, PASSED * fs_hz)
    frequency_hz, window = np.fft.rfftfreq(cubic.size, 1 / fs_hz), np.hanning(cubic.size)
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    off, whole = (np.linalg.norm(np.fft.rfft(window * (x - x.mean()))[inside]) for x in (quintic - cubic, cubic))
    error = float(off / whole) if whole else 0.0
    steps = np.diff(times_s)
    note = f"resampled from steps of {steps.min():.3g} to {steps.max():.3g} s to {fs_hz:g} Hz"
    said = f"{note}; estimated error {100 * error:.2g} % of the RMS in the band"
    cautions += (f"{said}: let the solver write smaller steps",) if error > LARGE_ERROR else ()
    notes, cautions = (*reading.notes, said), (*reading.cautions, *cautions)
    return replace(changed, fs_hz=fs_hz, resampling_error=error, notes=notes, cautions=cautions)


def _check_steps(path: Path, times_s: FloatArray, fs_hz: float, band_hz: tuple[float, float] | None) -> tuple[str, ...]:
    """Raise `DataError` if `fs_hz` is too low or high or a time step too long; return a caution about long steps."""
    seconds, steps, kept_hz = float(times_s[-1] - times_s[0]), np.diff(times_s), PASSED * fs_hz
    low, high = MIN_SAMPLES / seconds, MOST_SAMPLES * times_s.size / seconds
    if band_hz is not None:
        low = max(low, band_hz[1] / PASSED)
    if not low <= fs_hz <= high:
        raise DataError(
            f"{path}: --resample {fs_hz:g} Hz must be between {low:.6g} and {high:.6g} Hz: at least "
            f"{1 / PASSED:g} times the upper edge of the demodulation band, if it is stated; at least "
            f"{MIN_SAMPLES} samples; and at most {MOST_SAMPLES} times as many samples as in the file."
        )
    at, highest_hz = int(np.argmax(steps)), band_hz[1] if band_hz else kept_hz
    longest, limit = float(steps[at]), (LONGEST_STEP if band_hz else LONGEST_WITHOUT_BAND) / highest_hz
    carried_hz = LONGEST_STEP / longest
    if longest > limit:
        raise DataError(
            f"{path}: a time step of {longest:.4g} s at {times_s[at]:.6g} s is too long for signals of up to "
            f"{highest_hz:g} Hz; the limit is {limit:.4g} s. Let the solver write shorter steps, cut the step off "
            f"(--skip S), or use a band below {carried_hz:.4g} Hz (--band LO HI)."
        )
    if band_hz is None and carried_hz < kept_hz:
        return (f"steps of up to {longest:.4g} s: resampled signals are reliable below {carried_hz:.4g} Hz only",)
    return ()


def resample(times_s: FloatArray, samples: FloatArray, fs_hz: float, degree: int = CUBIC) -> FloatArray:
    """Resample to the rate `fs_hz` by a spline of `degree` on a fine grid and a linear-phase low-pass filter.

    Samples closer in time than `SAME_TIME` times the new step, as solvers write at events, are averaged first.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.signal import firwin, kaiserord, resample_poly

    close_s = SAME_TIME / fs_hz
    times, values = _average_groups(np.diff(np.floor((times_s - times_s[0]) / close_s)) > 0, times_s, samples)
    times, values = _average_groups(np.diff(times) > close_s / 2, times, values)
    count = int((times_s[-1] - times_s[0]) * fs_hz + SAME_TIME) + 1
    factor = max(FINE_SAMPLES_PER_STEP, math.ceil(FINE_SAMPLES_PER_STEP / (float(np.median(np.diff(times))) * fs_hz)))
    at = times[0] + np.arange((count - 1) * factor + 1) / (factor * fs_hz)
    taps, beta = kaiserord(STOPPED_DB, 2 * (STOPPED - PASSED) / factor)
    low_pass = firwin(taps | 1, (PASSED + STOPPED) / 2 * fs_hz, window=("kaiser", beta), fs=factor * fs_hz)
    fine = make_interp_spline(times, values, k=degree)(at)
    return np.asarray(resample_poly(fine, 1, factor, window=low_pass, padtype="antireflect"))


def _average_groups(
    separate: NDArray[np.bool_], times_s: FloatArray, samples: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean time and mean sample of each group; `separate` [n - 1] is true if a group ends between two samples."""
    group = np.concatenate(([0], np.cumsum(separate)))
    count = np.bincount(group)
    return np.bincount(group, times_s) / count, np.bincount(group, samples) / count


def as_accelerations(reading: Reading, derivatives: Mapping[str, int]) -> Reading:
    """Differentiate velocities and displacements to accelerations; `derivatives` maps units to orders of derivative."""
    count, changed, said = reading.main.samples.size, dict(reading.channels), set()
    for name, c in reading.channels.items():
        order = derivatives.get(c.recording_unit, 0)
        if order and reading.fs_hz and c.samples.size == count:
            samples = differentiate(c.samples, reading.fs_hz, order)
            factor = c.factor * UNITS[c.unit or ""][1] * SI_FACTORS[c.recording_unit]
            changed[name] = replace(c, samples=samples, unit=ACCELERATION_UNIT, factor=factor)
            said.add(f"acceleration: derivative {order} of {c.unit}")
    return replace(reading, channels=changed, notes=(*reading.notes, *sorted(said)))


def differentiate(samples: FloatArray, fs_hz: float, order: int) -> FloatArray:
    """Derivative of this order with respect to time [s], computed in the frequency domain.

    It is exact up to `PASSED` times the sampling rate and zero above `STOPPED` times the rate, so that high-frequency
    noise is not amplified. A polynomial of degree `order` is fitted, removed and differentiated exactly. Both ends of
    the remainder are extended by a fading mirror image, so that its periodic continuation has no step.
    """
    if order == 0:
        return samples
    at_s, mirrored = np.arange(samples.size) / fs_hz, min(MIRRORED, samples.size - 1)
    trend = np.polynomial.Polynomial.fit(at_s, samples, order)
    whole = np.pad(samples - trend(at_s), mirrored, mode="reflect", reflect_type="odd")
    fade = np.hanning(2 * mirrored)[:mirrored]
    whole[:mirrored] *= fade
    whole[-mirrored:] *= fade[::-1]
    share = np.fft.rfftfreq(whole.size)
    passed = np.sin(np.pi / 2 * np.clip((STOPPED - share) / (STOPPED - PASSED), 0, 1)) ** 2
    spectrum = np.fft.rfft(whole) * (2j * np.pi * fs_hz * share) ** order * passed
    return np.asarray(np.fft.irfft(spectrum, whole.size)[mirrored:-mirrored] + trend.deriv(order)(at_s))
