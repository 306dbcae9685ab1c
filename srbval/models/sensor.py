"""Signal of the sensor: acceleration along its axis, the path from ring to sensor, the RMS in each band."""

import math
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from srbval.arrays import FloatArray
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD, SensorPath, parts_along_sensor

BAND_FILTER_ORDER = 4  # order of the Butterworth band-pass
FILTER_S = 0.05  # length of a path's filters


def along_sensor(acceleration: FloatArray) -> FloatArray:
    """Component of accelerations, [n, 3], along the sensor's axis, [n]."""
    return acceleration[:, :2] @ np.array([math.cos(SENSOR_ANGLE_RAD), math.sin(SENSOR_ANGLE_RAD)])


def band_rms(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> float:
    """RMS of `samples` within a frequency band, in the unit of the samples; Hann window, sharp band edges.

    The samples must be means over their intervals, like a run's accelerations; the attenuation is compensated.
    """
    from scipy.fft import rfft

    window = hann(samples.size)
    lines = np.asarray(rfft((samples - samples.mean()) * window))
    frequency = np.arange(lines.size) * fs_hz / samples.size
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = np.abs(lines[inside]) ** 2 / np.sinc(frequency[inside] / fs_hz) ** 2
    return math.sqrt(2 * float(power.sum()) / (samples.size * float((window**2).sum())))


def band_squares(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Squares of band-passed `samples`, [n], by a zero-phase Butterworth filter; transients at both ends remain."""
    from scipy.signal import sosfiltfilt  # takes half a second to load

    return sosfiltfilt(_sections(fs_hz, band_hz), samples) ** 2


def hann(length: int) -> FloatArray:
    """Hann window without zeros at its ends, [length]."""
    return np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2


@cache
def _sections(fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    from scipy.signal import butter

    return butter(BAND_FILTER_ORDER, band_hz, "bandpass", fs=fs_hz, output="sos")


@dataclass
class BandLevels:
    """Running RMS of the sensor's signal in each frequency band of `BANDS_HZ`, by causal Butterworth filters."""

    fs_hz: float
    samples: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    _states: dict[str, FloatArray] = field(default_factory=dict)

    def add(self, along: FloatArray) -> None:
        """Add accelerations along the sensor's axis [m/s2], [n]."""
        from scipy.signal import sosfilt

        self.samples += len(along)
        for name, band_hz in BANDS_HZ.items():
            if band_hz[1] < 0.5 * self.fs_hz:
                sections = _sections(self.fs_hz, band_hz)
                state = self._states.get(name, np.zeros((len(sections), 2)))
                filtered, self._states[name] = sosfilt(sections, along, zi=state)
                self.squares[name] = self.squares.get(name, 0.0) + float(filtered @ filtered)

    def rms(self) -> dict[str, float]:
        """RMS in each band [m/s2]; NaN for a band that reaches half the sampling rate."""
        found = dict.fromkeys(BANDS_HZ, math.nan)
        return found | {name: math.sqrt(square / self.samples) for name, square in self.squares.items()}


class SensorFilter:
    """Filter that converts the ring's acceleration to the sensor's; without a `path`, the component along its axis.

    The path's frequency response is converted to an impulse response of the length `FILTER_S`, one for each direction
    of the ring's acceleration, and multiplied by a Hann window; this smooths the response within 40 Hz of the edges of
    the path's third octaves. The output is delayed by `FILTER_S` / 2 and begins at rest.
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
        from scipy.signal import oaconvolve

        joined = np.concatenate((self._before, parts_along_sensor(acceleration, self.load_direction_rad)))
        self._before = joined[len(joined) - len(self._before) :]
        return oaconvolve(joined, self._taps, mode="valid", axes=0).sum(axis=1)
