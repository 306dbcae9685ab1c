"""Signal of the sensor: acceleration along its axis, the path from ring to sensor, the RMS in each band."""

import math
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray
from srbval.butterworth import butterworth_gain
from srbval.scene import BANDS_HZ, SENSOR_AXIS, SensorPath, parts_along_sensor

DECAY_S = 0.02  # extension of a signal at each end before it is filtered
PIECE = 2**18  # samples that are filtered at once
FILTER_S = 0.05  # length of the impulse responses of a path


def along_sensor(acceleration: FloatArray) -> FloatArray:
    """Component of accelerations, [n, 3], along the sensor's axis, [n]."""
    return acceleration[:, :2] @ SENSOR_AXIS


def band_rms(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> float:
    """RMS of `samples` within a frequency band, in the unit of the samples; Hann window, sharp band edges.

    Each sample must be the mean of its interval, like a run's accelerations; this attenuation is compensated.
    """
    from scipy.fft import rfft

    window = hann(samples.size)
    lines = np.asarray(rfft((samples - samples.mean()) * window))
    frequency = np.arange(lines.size) * fs_hz / samples.size
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = np.abs(lines[inside]) ** 2 / np.sinc(frequency[inside] / fs_hz) ** 2
    return math.sqrt(2 * float(power.sum()) / (samples.size * float((window**2).sum())))


def band_squares(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], *, ways: int = 2) -> FloatArray:
    """Squares [n] of band-passed `samples`, without delay, with the gain of a Butterworth filter of one or two `ways`.

    The signal is extended at both ends by its reflection, in which the filter's response to the ends decays.
    """
    first = round(DECAY_S * fs_hz)
    longer = np.pad(samples, first, "reflect")
    lines = np.fft.rfft(longer)
    lines *= butterworth_gain(np.arange(lines.size) * fs_hz / longer.size, fs_hz, band_hz) ** (ways / 2)
    return np.fft.irfft(lines, longer.size)[first : first + samples.size] ** 2


def hann(length: int) -> FloatArray:
    """Hann window without zeros at its ends, [length]."""
    return np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2


@dataclass
class BandLevels:
    """RMS of the sensor's signal in each frequency band of `BANDS_HZ`, from pieces of at least `PIECE` samples."""

    fs_hz: float
    samples: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    piece: list[FloatArray] = field(default_factory=list)

    def add(self, along: FloatArray) -> None:
        """Add accelerations along the sensor's axis [m/s2], [n]."""
        self.piece.append(along)
        if sum(map(len, self.piece)) >= PIECE:
            self._end_piece()

    def rms(self) -> dict[str, float]:
        """RMS in each band [m/s2]; NaN for a band that reaches half the sampling rate."""
        self._end_piece()
        found = dict.fromkeys(BANDS_HZ, math.nan)
        return found | {name: math.sqrt(square / self.samples) for name, square in self.squares.items()}

    def _end_piece(self) -> None:
        along, self.piece = np.concatenate(self.piece or [np.zeros(0)]), []
        self.samples += along.size
        for name, band_hz in BANDS_HZ.items() if along.size else ():
            if band_hz[1] < 0.5 * self.fs_hz:
                square = float(band_squares(along, self.fs_hz, band_hz, ways=1).sum())
                self.squares[name] = self.squares.get(name, 0.0) + square


class SensorFilter:
    """Filter from the ring's acceleration to the sensor's; without a `path`, the component along the sensor's axis.

    The frequency response of the `path` from ring to sensor, along the load and across it, has a step from each third
    octave to the next. It is converted to an impulse response of the length `FILTER_S` by a Hann window, which smooths
    each step within 2 / `FILTER_S` = 40 Hz. The output is delayed by `FILTER_S` / 2. Before the first sample the
    acceleration counts as zero.
    """

    def __init__(self, path: SensorPath | None, fs_hz: float, load_direction_rad: float) -> None:
        self.load_direction_rad = load_direction_rad
        half = round(0.5 * FILTER_S * fs_hz)
        self._before = np.zeros((2 * half, 2))
        self._taps: FloatArray | None = None
        if path is not None:
            length = 8 * (2 * half + 1)  # so long that the response does not wrap around
            impulse = np.fft.irfft(path.response(np.arange(length // 2 + 1) * fs_hz / length), length)
            self._taps = np.roll(impulse, half, axis=1)[:, : 2 * half + 1].T * hann(2 * half + 1)[:, None]

    def add(self, acceleration: FloatArray) -> FloatArray:
        """Acceleration at the sensor [m/s2], [n], from the next n accelerations of the ring, [n, 3]."""
        if self._taps is None:
            return along_sensor(acceleration)
        joined = np.concatenate((self._before, parts_along_sensor(acceleration, self.load_direction_rad)))
        kept = len(self._before)  # the convolution is cyclic: its first values, as many as these, are not valid
        self._before = joined[len(joined) - kept :]
        lines = (np.fft.rfft(joined, axis=0) * np.fft.rfft(self._taps, len(joined), axis=0)).sum(axis=1)
        return np.fft.irfft(lines, len(joined))[kept:]
