"""The one chain from a recording to its envelope spectrum, the same for measured and simulated records."""

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.errors import ConfigurationError
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD
from srbval.signal import (
    NORMAL_95,
    BandFilter,
    ShaftAngle,
    Spectrum,
    amplitude_spectrum,
    analytic_signal,
    check_band,
    drop_ends,
    end_s,
    normalise,
    rotate_axes,
    squared_envelope_one_pass,
)

# Giraudo et al. 2025 (Sensors 25, 2419), sect. 5: band found best for the simulated signals.
SIMULATED_BAND_HZ = BANDS_HZ["500-1500"]
# Signals are normalised, so every amplitude is in standard deviations of the whole record.
UNIT, SQUARED_UNIT = "standard deviations", "squared standard deviations"
MEASURED_SPEEDS = (SpeedSource.TACHOMETER, SpeedSource.PRESCRIBED)
# Share of the record that the speed signal must cover.
LEAST_COVERAGE = 0.98


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracking:
    """Whether the shaft's course was followed, and why (not).

    `drift_bins` is how far the fault line of the highest order moves in the record, None without a speed signal;
    `course` is followed where it is given, and then the shaft turns at exactly `mean_hz` in the spectra.
    """

    why: str
    drift_bins: float | None = None
    course: ShaftAngle | None = None
    mean_hz: float = 0.0

    @property
    def used(self) -> bool:
        """Are the spectra those of even shaft angles?"""
        return self.course is not None


NOT_TRACKED = Tracking(why="no order tracking: not asked for")


@dataclass(frozen=True, kw_only=True, eq=False)
class Processed:
    """A record after the chain, without the `end_s` [s] at either end that the filter spoils.

    `samples`, [n] at `fs_hz`, is the rotated, normalised signal; `squared`, [m] at `squared_fs_hz`, its squared
    envelope in the band at a rate that holds it, which lines are read from: at even shaft angles where `tracking`
    was used. `scale` is the standard deviation that was divided by, in the recording's unit.
    """

    whole: FloatArray
    squared: FloatArray
    squared_fs_hz: float
    fs_hz: float
    band_hz: tuple[float, float]
    band_filter: BandFilter
    end_s: float
    scale: float
    tracking: Tracking

    @property
    def samples(self) -> FloatArray:
        """The rotated, normalised signal, [n]."""
        return drop_ends(self.whole, self.fs_hz, self.end_s)

    @functools.cached_property
    def _analytic(self) -> NDArray[np.complex128]:
        return analytic_signal(self.whole, self.fs_hz, self.band_hz, band_filter=self.band_filter)

    @functools.cached_property
    def filtered(self) -> FloatArray:
        """`samples` band-passed, [n], in time."""
        return drop_ends(self._analytic.real, self.fs_hz, self.end_s)

    @functools.cached_property
    def envelope(self) -> FloatArray:
        """The Hilbert modulus of that, [n], in time: the paper's envelope."""
        return drop_ends(np.abs(self._analytic), self.fs_hz, self.end_s)

    @functools.cached_property
    def spectrum(self) -> Spectrum:
        """Amplitude spectrum of `envelope` [`UNIT`], at even shaft angles where these were followed."""
        return amplitude_spectrum(tracked(self.envelope, self.fs_hz, self.end_s, self.tracking), self.fs_hz)

    @property
    def seconds(self) -> float:
        """Duration of what is left [s]."""
        return self.squared.size / self.squared_fs_hz

    @property
    def chain(self) -> str:
        """Filter, band and envelope in a few words."""
        low, high = self.band_hz
        return f"{low:g} to {high:g} Hz, {self.band_filter.label}; {self.end_s:.3g} s dropped at each end"


def process(
    recording: Recording,
    *,
    band_hz: tuple[float, float],
    channel: str | None = None,
    band_filter: BandFilter = BandFilter.BUTTERWORTH,
    tracking: Tracking = NOT_TRACKED,
) -> Processed:
    """Rotate (two axes only), normalise, band-pass and take the envelope in one pass, drop the ends.

    Follows sect. 5 of the paper, whose chain (`bandpass`, `envelope`) the one pass equals within 1e-5 of the largest
    value wherever that chain itself is right. `channel` picks one channel instead of the recording's own choice.
    Raises `ConfigurationError` for an unknown channel or a band out of reach, `DataError` for a constant or short one.
    """
    check_band(band_hz, recording.fs_hz)
    signal = one_signal(recording, channel)
    whole = normalise(signal)
    ends = end_s(band_hz)
    square, rate = squared_envelope_one_pass(whole, recording.fs_hz, band_hz, band_filter=band_filter)
    return Processed(
        whole=whole,
        squared=tracked(drop_ends(square, rate, ends), rate, ends, tracking),
        squared_fs_hz=rate,
        fs_hz=recording.fs_hz,
        band_hz=band_hz,
        band_filter=band_filter,
        end_s=ends,
        scale=float(np.std(signal)),
        tracking=tracking,
    )


def choose_tracking(recording: Recording, bearing: Bearing, speed: ShaftSpeed) -> Tracking:
    """Follow the speed signal wherever there is one, or say why not.

    Needs a speed signal over the whole record that `speed` is the mean of. Raises `DataError` for one in which the
    shaft stops.
    """
    signal = recording.speed_signal
    if signal is None or speed is not recording.speed or speed.source not in MEASURED_SPEEDS:
        return Tracking(why="no order tracking: the speed used comes without its course")
    if signal.values_hz.size / signal.rate_hz < LEAST_COVERAGE * recording.seconds:
        return Tracking(why="no order tracking: the speed signal is shorter than the record")
    course = ShaftAngle.from_speed(signal.values_hz, signal.rate_hz)
    bins = course.drift_bins(max(bearing.orders.bpfo, bearing.orders.bpfi))
    return Tracking(
        why=f"order tracking: with the speed the race lines move by {bins:.2g} bins; resampled to even shaft angles, "
        "frequencies are those at the mean speed",
        drift_bins=bins,
        course=course,
        mean_hz=speed.value_hz,
    )


def speed_of_record(speed: ShaftSpeed, tracking: Tracking) -> ShaftSpeed:
    """`speed`, less sure where its course is not followed: the mean of a part is any speed within the spread."""
    if tracking.used or not speed.spread_hz:
        return speed
    return replace(speed, ci95_hz=math.hypot(speed.ci95_hz, NORMAL_95 * speed.spread_hz))


def tracked(samples: FloatArray, fs_hz: float, start_s: float, tracking: Tracking) -> FloatArray:
    """`samples` [n], the first at `start_s`, at even shaft angles where `tracking` has a course, else as they are."""
    if tracking.course is None:
        return samples
    return tracking.course.resample(samples, fs_hz, start_s, tracking.mean_hz)


def one_signal(recording: Recording, channel: str | None = None) -> FloatArray:
    """The channel to analyse, or the two axes rotated onto the sensor's direction, [n], in the recording's unit."""
    name = channel if channel is not None else recording.channel
    if name is not None:
        if name not in recording.channels:
            raise ConfigurationError(f"{recording.name}: no channel {name!r}; it has {', '.join(recording.channels)}.")
        return recording.channels[name]
    first, second = recording.axes or ("", "")
    return rotate_axes(recording.channels[first], recording.channels[second], SENSOR_ANGLE_RAD)
