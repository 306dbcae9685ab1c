"""Processing of a recording to the periodogram of its envelope, the same for measured and simulated records."""

import functools
import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.errors import ConfigurationError
from srbval.reading.families import highest_line_hz
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD
from srbval.scene.read import size_of
from srbval.signal import (
    Periodogram,
    ShaftAngle,
    Spectrum,
    amplitude_spectrum,
    analytic_signal,
    drop_ends,
    end_s,
    kurtogram,
    normalise,
    prewhitened,
    rotate_axes,
    squared_envelope_one_pass,
)
from srbval.signal.envelope import END_PERIODS

SIMULATED_BAND_HZ = BANDS_HZ["500-1500"]  # Giraudo et al. 2025 (Sensors 25, 2419), sect. 5, as for the rig
RIG_BEARING = "skf-22240"
LEAST_REVOLUTIONS = 8  # false BPFO lines in 60 records of noise at 12 kHz: 11 in 4 revolutions, 7 in 6, 3 in 7
HARMONICS_HELD = 3  # harmonics of the higher race line that the envelope of a band must contain
WHOLE_BAND = (0.01, 0.47)  # the whole band, as shares of the sampling rate
SQUARED_UNIT = "squared standard deviations"  # of the whole record, by which signals are normalised
MEASURED_SPEEDS = (SpeedSource.TACHOMETER, SpeedSource.PRESCRIBED)
USABLE_SHARE = 0.9  # of the band's width: the floor of the squared envelope's spectrum ends at the width
LARGEST_MASK_SHARE = 5e-4  # of a shaft harmonic's frequency: wider masks would join and hide every line
WHITENED_BANDS = 4  # parts of the whole band: of 1, 4 and 8 the best by the log score of diagnoses with rigs left out
CLIP = 12.0  # medians of the squared envelope; noise alone exceeds them once in 4096 values, 2^-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracking:
    """Order tracking: `course` is the shaft angle over time, None if the record is not tracked; `why` is the reason.

    Frequencies in tracked spectra are those at the speed `mean_hz`. `drift_bins` is the number of frequency bins by
    which BPFI moves within the record because the speed drifts, None if the record is not tracked.
    """

    why: str
    drift_bins: float | None = None
    course: ShaftAngle | None = None
    mean_hz: float = 0.0

    @property
    def used(self) -> bool:
        """True if the spectra are computed at even shaft angles."""
        return self.course is not None

    def resample(self, samples: FloatArray, fs_hz: float, start_s: float) -> FloatArray:
        """Resample `samples` [n], the first at `start_s`, at even shaft angles; unchanged without order tracking."""
        return samples if self.course is None else self.course.resample(samples, fs_hz, start_s, self.mean_hz)


NOT_TRACKED = Tracking(why="no order tracking: not requested")


@dataclass(frozen=True, kw_only=True, eq=False)
class Processed:
    """Normalised signal and squared envelope of a record.

    `whole` [n] is the normalised signal; `scale` is the standard deviation by which it was divided, in the recording's
    unit. `squared` [m] is its squared envelope in the band, at a lower rate, without the `end_s` [s] at either end that
    the filter distorts, and at even shaft angles if `tracking` is used. `trials` is the number of parts of a long
    record among which this part was chosen, otherwise 1.
    """

    whole: FloatArray
    squared: FloatArray
    squared_fs_hz: float
    fs_hz: float
    band_hz: tuple[float, float]
    end_s: float
    scale: float
    tracking: Tracking
    trials: int = 1

    @property
    def samples(self) -> FloatArray:
        """Signal with mean zero and standard deviation one, without the ends that the filter distorts, [n]."""
        return drop_ends(self.whole, self.fs_hz, self.end_s)

    @functools.cached_property
    def _analytic(self) -> NDArray[np.complex128]:
        return analytic_signal(self.whole, self.fs_hz, self.band_hz)

    @functools.cached_property
    def filtered(self) -> FloatArray:
        """Band-passed signal over time without its ends, [n]."""
        return drop_ends(self._analytic.real, self.fs_hz, self.end_s)

    @functools.cached_property
    def envelope(self) -> FloatArray:
        """Envelope of the band-passed signal over time, the modulus of its analytic signal, [n]."""
        return drop_ends(np.abs(self._analytic), self.fs_hz, self.end_s)

    @functools.cached_property
    def spectrum(self) -> Spectrum:
        """Amplitude spectrum of `envelope`, in standard deviations of the signal, over shaft angle if it is tracked."""
        return amplitude_spectrum(self.tracking.resample(self.envelope, self.fs_hz, self.end_s), self.fs_hz)

    @property
    def seconds(self) -> float:
        """Duration of the record without its ends [s]."""
        return self.squared.size / self.squared_fs_hz


def process(
    recording: Recording, *, band_hz: tuple[float, float], tracking: Tracking = NOT_TRACKED, ends_s: float | None = None
) -> Processed:
    """Normalise and band-pass the signal of a recording, compute its squared envelope, and drop the ends.

    Signals of two axes are first combined. The result equals the chain of Giraudo et al. 2025, sect. 5 (two-way
    Butterworth filter, Hilbert transform, modulus) within 1e-5 of the largest value. `ends_s`: time dropped at each
    end. Raises `ConfigurationError` for an unknown channel or impossible band, `DataError` for an unusable signal.
    """
    signal, ends = one_signal(recording), end_s(band_hz) if ends_s is None else ends_s
    whole = normalise(signal)
    square, rate = squared_envelope_one_pass(whole, recording.fs_hz, band_hz)
    return Processed(
        whole=whole,
        squared=tracking.resample(drop_ends(square, rate, ends), rate, ends),
        squared_fs_hz=rate,
        fs_hz=recording.fs_hz,
        band_hz=band_hz,
        end_s=ends,
        scale=float(np.std(signal)),
        tracking=tracking,
    )


def choose_tracking(recording: Recording, bearing: Bearing, speed: ShaftSpeed) -> Tracking:
    """Choose order tracking if a speed signal of mean `speed` covers the whole record; otherwise give the reason."""
    signal = recording.speed_signal
    if signal is None or speed is not recording.speed or speed.source not in MEASURED_SPEEDS:
        return Tracking(why="no order tracking: the speed used comes without its course")
    if signal.values_hz.size / signal.rate_hz < 0.98 * recording.seconds:
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


def one_signal(recording: Recording) -> FloatArray:
    """Signal to analyse, [n] in the recording's unit: one channel, or two axes rotated to the sensor's direction."""
    if (name := recording.channel) is not None:
        if name not in recording.channels:
            raise ConfigurationError(f"{recording.name}: no channel {name!r}; it has {', '.join(recording.channels)}.")
        return recording.channels[name]
    first, second = recording.axes or ("", "")
    return rotate_axes(recording.channels[first], recording.channels[second], SENSOR_ANGLE_RAD)


@dataclass(frozen=True, kw_only=True)
class BandChoice:
    """Band [Hz], the reason for its choice, and the number of bands tried on the record."""

    band_hz: tuple[float, float]
    why: str
    trials: int = 1


def declared_band(
    recording: Recording, band_hz: tuple[float, float] | None, bearing: Bearing | None = None
) -> BandChoice | None:
    """Given band [Hz], else the record's, else the band of Giraudo et al. 2025 for their rig and simulated records.

    The band of a simulated larger bearing is lower by the ratio of the sizes. None for other records.
    """
    if band_hz is not None:
        return BandChoice(band_hz=band_hz, why="given")
    if recording.band_hz is not None:
        return BandChoice(band_hz=recording.band_hz, why="stated for the record, by its data set or the user")
    if recording.origin is Origin.SIMULATED:
        size = size_of(bearing) if bearing is not None and bearing.geometry is not None else None
        if size is None or size <= 1 + 0.01:
            return BandChoice(band_hz=SIMULATED_BAND_HZ, why="the paper's")
        low, high = (round(edge / size) for edge in SIMULATED_BAND_HZ)
        return BandChoice(band_hz=(low, high), why=f"the paper's, for a bearing {size:.3g} times as large")
    own = recording.dataset is None and recording.origin is Origin.MEASURED  # the same bearing in another machine
    if own or recording.bearing != RIG_BEARING:
        return None
    return BandChoice(band_hz=BANDS_HZ["1400-2800"], why="the paper's")


def whole_band_of(fs_hz: float, why: str = "the whole band, the same for all records that are compared") -> BandChoice:
    """Whole usable band of a record sampled at `fs_hz`; `why` is the reason to use it."""
    low, high = (share * fs_hz for share in WHOLE_BAND)
    return BandChoice(band_hz=(low, high), why=why)


def bands_of_record(
    recording: Recording, bearing: Bearing, speed: ShaftSpeed, within_fs_hz: float = math.inf
) -> tuple[BandChoice, ...]:
    """Bands to try, all below half the rate `within_fs_hz`: the whole band and the most impulsive narrower band.

    Only the whole band if no narrower band is `HARMONICS_HELD` times as wide as BPFI, or if the filters of narrower
    bands distort too much of the record at its ends.
    """
    fs_hz = min(recording.fs_hz, within_fs_hz)
    lines_hz = HARMONICS_HELD * max(bearing.orders.bpfo, bearing.orders.bpfi) * speed.value_hz
    for_ends_s = recording.seconds - LEAST_REVOLUTIONS / speed.value_hz
    ends_hz = 2 * END_PERIODS / for_ends_s if for_ends_s > 0 else math.inf
    samples = normalise(one_signal(recording))
    picture = kurtogram(samples, recording.fs_hz, least_width_hz=max(lines_hz, ends_hz), highest_hz=0.499 * fs_hz)
    count, whole = picture.kurtosis.size, "the whole band"
    if count == 0:
        why = f"{whole}: narrower bands have fewer than {HARMONICS_HELD} harmonics of the race lines or too long ends"
        return (whole_band_of(fs_hz, why),)
    impulsive = f"the most impulsive of {count} bands of this record (kurtogram)"
    said = "{}, in which a fault's line is clearer than in {}; false-alarm probabilities count {} trials"
    return (
        replace(whole_band_of(fs_hz, said.format(whole, impulsive, 2)), trials=2),
        BandChoice(band_hz=picture.best_hz, why=said.format(impulsive, whole, 2 * count), trials=2 * count),
    )


def periodogram_of(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> Periodogram:
    """Periodogram of the squared envelope, with the harmonics of the shaft at `speed` masked."""
    width_hz = processed.band_hz[1] - processed.band_hz[0]
    return Periodogram.of(
        processed.squared,
        processed.squared_fs_hz,
        limit_hz=min(highest_line_hz(bearing, speed.value_hz), USABLE_SHARE * width_hz),
        shaft_hz=speed.value_hz,
        shaft_ci_hz=min(speed.ci95_hz, LARGEST_MASK_SHARE * speed.value_hz),
    )


def whitened_bands(
    processed: Processed, bearing: Bearing, speed: ShaftSpeed, stretch: float = 1.0
) -> tuple[Periodogram, ...]:
    """Periodograms of the squared envelope in equal parts of the whole band, frequencies multiplied by `stretch`.

    There are `WHITENED_BANDS` parts, or fewer if these would be too narrow for the lines of the bearing. The record is
    prewhitened by its cepstrum; squared envelopes are clipped so that single knocks imitate no fault.
    """
    low, high = whole_band_of(processed.fs_hz).band_hz
    needed_hz = highest_line_hz(bearing, speed.value_hz) / USABLE_SHARE
    edges = np.linspace(low, high, 1 + max(1, min(WHITENED_BANDS, math.floor((high - low) / needed_hz)))).tolist()
    white, ends, found = prewhitened(processed.whole), min(processed.end_s, end_s((low, high))), []
    for band_hz in itertools.pairwise(edges):
        square, rate = squared_envelope_one_pass(white, processed.fs_hz, band_hz)
        square = np.minimum(square, CLIP * float(np.median(square)))
        square = processed.tracking.resample(drop_ends(square, rate, ends), rate, ends)
        part = replace(processed, squared=square, squared_fs_hz=stretch * rate, band_hz=band_hz)
        record = periodogram_of(part, bearing, speed)
        is_short = record.seconds * speed.value_hz < LEAST_REVOLUTIONS  # shaft harmonics would mask nearly all bins
        found.append(replace(record, masks_hz=record.masks_hz[:0]) if is_short else record)
    return tuple(found)
