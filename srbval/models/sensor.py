"""What the sensor shows of a run: the ring's motion along its axis, the scene's path to it, the level in each band."""

import math
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD, SensorPath

ORDER = 4  # of the Butterworth band-pass
FITTED = 0.4  # share of the sampling rate up to which a mode may lie
POINTS = 400  # of the fit


def along_sensor(acceleration: FloatArray) -> FloatArray:
    """The component of accelerations, [n, 3], along the sensor's axis."""
    component: FloatArray = acceleration[:, :2] @ np.array([math.cos(SENSOR_ANGLE_RAD), math.sin(SENSOR_ANGLE_RAD)])
    return component


def band_rms(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> float:
    """RMS of `samples` within a band, in their unit.

    `samples` are means over their intervals, as a run's accelerations are: what that takes from high frequencies is put
    back, so that runs of different output rate can be compared. Hann window; brick-wall band.
    """
    from scipy.fft import rfft

    window = hann(samples.size)
    lines = np.asarray(rfft((samples - samples.mean()) * window))
    frequency = np.arange(lines.size) * fs_hz / samples.size
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = np.abs(lines[inside]) ** 2 / np.sinc(frequency[inside] / fs_hz) ** 2
    return math.sqrt(2 * float(power.sum()) / (samples.size * float((window**2).sum())))


def band_squares(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Squares of `samples`, [n], in a band, by a Butterworth band-pass without phase, [n]; ends are its transients."""
    from scipy.signal import sosfiltfilt  # takes half a second to load, and who reads a stored run needs none

    squares: FloatArray = sosfiltfilt(_sections(fs_hz, band_hz), samples) ** 2
    return squares


def hann(length: int) -> FloatArray:
    """Hann's window without its zeros, [length]."""
    window: FloatArray = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    return window


@cache
def _sections(fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    from scipy.signal import butter

    sections: FloatArray = butter(ORDER, band_hz, "bandpass", fs=fs_hz, output="sos")
    return sections


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
        from scipy.signal import sosfilt

        self.samples += len(along)
        for name, band_hz in BANDS_HZ.items():
            if band_hz[1] < 0.5 * self.fs_hz:
                sections = _sections(self.fs_hz, band_hz)
                state = self._states.get(name, np.zeros((len(sections), 2)))
                filtered, self._states[name] = sosfilt(sections, along, zi=state)
                self.squares[name] = self.squares.get(name, 0.0) + float(filtered @ filtered)

    def rms(self) -> dict[str, float]:
        """RMS in each band below half the rate [m/s2]; NaN for a band that does not lie there."""
        found = dict.fromkeys(BANDS_HZ, math.nan)
        return found | {name: math.sqrt(square / self.samples) for name, square in self.squares.items()}


class SensorFilter:
    """What the sensor shows of the ring's acceleration along its axis; without a `path`, that itself.

    Each mode of the path becomes a digital resonator with the poles of the analogue one, z = exp(s T), so that
    frequency and damping are the mode's own. It starts at rest, so that a mode's first 1 / (zeta f) seconds are its
    beginning's. `ConfigurationError` for a mode beyond what the rate can show.
    """

    def __init__(self, path: SensorPath | None, fs_hz: float) -> None:
        self.path = path
        self._resonators: list[tuple[FloatArray, FloatArray]] = []
        for mode in path.modes if path else ():
            if mode.frequency_hz > FITTED * fs_hz:
                raise ConfigurationError(
                    f"sensor_path mode at {mode.frequency_hz:g} Hz lies above {FITTED:g} of output_rate_hz = "
                    f"{fs_hz:g}: raise output_rate or leave the mode out."
                )
            self._resonators.append(_resonator(mode.frequency_hz, mode.damping_ratio, mode.gain, fs_hz))
        self._states = [np.zeros(2) for _ in self._resonators]

    def add(self, along: FloatArray) -> FloatArray:
        """The sensor's acceleration over the next samples of the ring's along its axis, [n] each, in m/s2."""
        if self.path is None:
            return along
        from scipy.signal import lfilter

        found = self.path.direct * along
        for place, (numerator, denominator) in enumerate(self._resonators):
            part, self._states[place] = lfilter(numerator, denominator, along, zi=self._states[place])
            found += part
        return found


def _resonator(frequency_hz: float, damping_ratio: float, gain: float, fs_hz: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator, [3] each.

    The numerator is the least-squares fit of three taps to the mode's response up to `FITTED` of the rate, relative to
    the response of the poles.
    """
    radians = 2 * math.pi * frequency_hz / fs_hz
    decay = math.exp(-damping_ratio * radians)
    turn = radians * math.sqrt(1 - damping_ratio**2)
    denominator = np.array([1.0, -2 * decay * math.cos(turn), decay**2])
    ratio = np.linspace(0.01, FITTED, POINTS) * fs_hz / frequency_hz
    ratio = np.sort(np.append(ratio, 1.0))
    delays = np.exp(-1j * radians * np.outer(ratio, np.arange(3)))
    wanted = gain * ratio**2 / (ratio**2 - 1 - 2j * damping_ratio * ratio)
    rows = delays / (delays @ denominator)[:, None]
    numerator, *_ = np.linalg.lstsq(np.vstack((rows.real, rows.imag)), np.append(wanted.real, wanted.imag), rcond=None)
    return np.asarray(numerator), denominator
