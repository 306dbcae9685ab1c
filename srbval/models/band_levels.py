"""Vibration in the analysis bands, along the sensor's axis: of a whole record, or summed as a run goes."""

import math
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import scipy.fft
import scipy.signal

from srbval.arrays import FloatArray

SENSOR_ANGLE_RAD = math.pi / 4  # from x to y; Giraudo et al. 2025, Sensors 25, 2419, sect. 5
BANDS_HZ = {"500-1500": (500.0, 1500.0), "1400-2800": (1400.0, 2800.0)}  # the same: simulated and measured signals
ORDER = 4  # of the Butterworth band-pass


def along_sensor(acceleration: FloatArray) -> FloatArray:
    """The component of accelerations, [n, 3], along the sensor's axis."""
    component: FloatArray = acceleration[:, :2] @ np.array([math.cos(SENSOR_ANGLE_RAD), math.sin(SENSOR_ANGLE_RAD)])
    return component


def band_rms(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> float:
    """RMS of `samples` within a band, in their unit.

    `samples` are means over their intervals, as a run's accelerations are: what that takes from high frequencies is put
    back, so that runs of different output rate can be compared. Hann window; brick-wall band.
    """
    window = hann(samples.size)
    lines = np.asarray(scipy.fft.rfft((samples - samples.mean()) * window))
    frequency = np.arange(lines.size) * fs_hz / samples.size
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = np.abs(lines[inside]) ** 2 / np.sinc(frequency[inside] / fs_hz) ** 2
    return math.sqrt(2 * float(power.sum()) / (samples.size * float((window**2).sum())))


def band_squares(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Squares of `samples`, [n], in a band, by a Butterworth band-pass without phase, [n]; ends are its transients."""
    squares: FloatArray = scipy.signal.sosfiltfilt(_sections(fs_hz, band_hz), samples) ** 2
    return squares


def hann(length: int) -> FloatArray:
    """Hann's window without its zeros, [length]."""
    window: FloatArray = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    return window


@dataclass
class BandLevels:
    """Sums for the RMS in each of `BANDS_HZ` of what the sensor shows, which comes chunk by chunk.

    A causal Butterworth band-pass of order `ORDER`, so that nothing is kept but its state.
    """

    fs_hz: float
    samples: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    _states: dict[str, FloatArray] = field(default_factory=dict)

    def add(self, along: FloatArray) -> None:
        """Count accelerations along the sensor's axis in, [n], in m/s2."""
        self.samples += len(along)
        for name, band_hz in self._bands():
            sections = _sections(self.fs_hz, band_hz)
            state = self._states.get(name, np.zeros((len(sections), 2)))
            filtered, self._states[name] = scipy.signal.sosfilt(sections, along, zi=state)
            self.squares[name] = self.squares.get(name, 0.0) + float(filtered @ filtered)

    def rms(self) -> dict[str, float]:
        """RMS in each band below half the rate [m/s2]; NaN for a band that does not lie there."""
        found = dict.fromkeys(BANDS_HZ, math.nan)
        return found | {name: math.sqrt(square / self.samples) for name, square in self.squares.items()}

    def _bands(self) -> list[tuple[str, tuple[float, float]]]:
        return [(name, band) for name, band in BANDS_HZ.items() if band[1] < 0.5 * self.fs_hz]


@cache
def _sections(fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    sections: FloatArray = scipy.signal.butter(ORDER, band_hz, "bandpass", fs=fs_hz, output="sos")
    return sections
