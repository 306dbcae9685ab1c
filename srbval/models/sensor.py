"""Signal of the sensor: acceleration along its axis, the path from ring to sensor, the RMS in each band."""

import math
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np

from srbval.arrays import ComplexArray, FloatArray
from srbval.scene import BANDS_HZ, SENSOR_AXIS, SensorPath, parts_along_sensor

BAND_FILTER_ORDER = 4  # of the Butterworth band-pass's prototype, which has half as many poles
EDGE = 27  # number of samples by which a signal is continued at each end before it is filtered forward and backward
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


def band_squares(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Squares of band-passed `samples`, [n], by a zero-phase Butterworth filter, which runs forward and backward.

    The signal is extended at both ends by its point reflection (odd extension), and the filter starts each time in
    its steady state. This reduces the transients at both ends.
    """
    passed = np.pad(samples, EDGE, "reflect", reflect_type="odd")
    for _ in range(2):
        steady = passed[0] / (1 - _one_pole_filters(fs_hz, band_hz)[0])
        passed = band_pass(passed, fs_hz, band_hz, steady)[0][::-1]
    return passed[EDGE:-EDGE] ** 2


def hann(length: int) -> FloatArray:
    """Hann window without zeros at its ends, [length]."""
    return np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2


def band_pass(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], state: ComplexArray
) -> tuple[FloatArray, ComplexArray]:
    """Filter `samples`, [n], by a causal Butterworth band-pass; returns the result, [n], and the filter's next `state`.

    The filter is a sum of one-pole filters; each entry of `state` is the sum of all samples before, weighted by the
    powers of one pole. So the output is a convolution of the samples with the impulse response, plus the decay of the
    state. `scipy.signal` gives the same result, to 1e-12, but takes 0.7 s to load.
    """
    count = len(samples)
    powers, decay, response = _responses(fs_hz, band_hz, count)
    passed = np.fft.irfft(np.fft.rfft(samples, 2 * count) * response, 2 * count)[:count]
    return passed + (state @ decay).real, powers[:, count] * state + powers[:, count - 1 :: -1] @ samples


@lru_cache(maxsize=16)
def _responses(fs_hz: float, band_hz: tuple[float, float], count: int) -> tuple[ComplexArray, ...]:
    """For `band_pass` on `count` samples: powers of poles, decay of earlier input, spectrum of impulse response."""
    poles, weights, gain = _one_pole_filters(fs_hz, band_hz)
    powers = poles[:, None] ** np.arange(count + 1)
    impulse = (weights @ powers[:, :count]).real
    impulse[0] = gain
    return powers, weights[:, None] * powers[:, 1:], np.fft.rfft(impulse, 2 * count)


@cache
def _one_pole_filters(fs_hz: float, band_hz: tuple[float, float]) -> tuple[ComplexArray, ComplexArray, float]:
    """Poles and weights of one-pole filters whose sum is a Butterworth band-pass; first value of its impulse response.

    Bilinear transform with corrected band edges of the analogue filter (Oppenheim & Schafer, Discrete-Time Signal
    Processing, ch. 7), then expansion in partial fractions.
    """
    rate, angle = 2 * fs_hz, np.pi / 2 * (1 + np.arange(1, 2 * BAND_FILTER_ORDER, 2) / BAND_FILTER_ORDER)
    low, high = rate * np.tan(np.pi * np.array(band_hz) / fs_hz)
    middle = np.exp(1j * angle) * (high - low) / 2
    apart = np.sqrt(middle**2 - low * high)
    analogue = np.concatenate([middle + apart, middle - apart])
    poles = np.asarray((rate + analogue) / (rate - analogue), dtype=np.complex128)
    gain = float(((rate * (high - low)) ** BAND_FILTER_ORDER / np.prod(rate - analogue)).real)
    ratios = 1 - poles / poles[:, None]
    np.fill_diagonal(ratios, 1)
    weights = gain * (1 - poles**-2.0) ** BAND_FILTER_ORDER / ratios.prod(axis=1)
    return poles, weights, gain


@dataclass
class BandLevels:
    """Running RMS of the sensor's signal in each frequency band of `BANDS_HZ`, see `band_pass`."""

    fs_hz: float
    samples: int = 0
    squares: dict[str, float] = field(default_factory=dict)
    _states: dict[str, ComplexArray] = field(default_factory=dict)

    def add(self, along: FloatArray) -> None:
        """Add accelerations along the sensor's axis [m/s2], [n]."""
        self.samples += len(along)
        for name, band_hz in BANDS_HZ.items():
            if band_hz[1] < 0.5 * self.fs_hz:
                state = self._states.get(name, np.zeros(2 * BAND_FILTER_ORDER, np.complex128))
                passed, self._states[name] = band_pass(along, self.fs_hz, band_hz, state)
                self.squares[name] = self.squares.get(name, 0.0) + float(passed @ passed)

    def rms(self) -> dict[str, float]:
        """RMS in each band [m/s2]; NaN for a band that reaches half the sampling rate."""
        found = dict.fromkeys(BANDS_HZ, math.nan)
        return found | {name: math.sqrt(square / self.samples) for name, square in self.squares.items()}


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
