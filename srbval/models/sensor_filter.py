"""A scene's path to the sensor as a filter in time, for samples that come chunk by chunk.

Each mode becomes a digital resonator with the poles of the analogue one, z = exp(s T), so that frequency and damping
are the mode's own. Its numerator is the least-squares fit of three taps to the mode's response up to `FITTED` of the
rate, relative to the response of the poles.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.scene import SensorPath

FITTED = 0.4  # share of the sampling rate up to which a mode may lie
POINTS = 400  # of the fit


@dataclass
class SensorFilter:
    """What the sensor shows of the ring's acceleration along its axis; without a `path`, that itself.

    It starts at rest, so that a mode's first 1 / (zeta f) seconds are its beginning's. `ConfigurationError` for a mode
    beyond what the rate can show.
    """

    path: SensorPath | None
    fs_hz: float
    _taps: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    _states: list[FloatArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        for mode in self.path.modes if self.path else ():
            if mode.frequency_hz > FITTED * self.fs_hz:
                raise ConfigurationError(
                    f"sensor_path mode at {mode.frequency_hz:g} Hz lies above {FITTED:g} of output_rate_hz = "
                    f"{self.fs_hz:g}: raise output_rate or leave the mode out."
                )
            self._taps.append(taps(mode.frequency_hz, mode.damping_ratio, mode.gain, self.fs_hz))
            self._states.append(np.zeros(2))

    def add(self, along: FloatArray) -> FloatArray:
        """The sensor's acceleration over the next samples of the ring's along its axis, [n] each, in m/s2."""
        if self.path is None:
            return along
        found = self.path.direct * along
        for place, (numerator, denominator) in enumerate(self._taps):
            part, self._states[place] = scipy.signal.lfilter(numerator, denominator, along, zi=self._states[place])
            found += part
        return found


def taps(frequency_hz: float, damping_ratio: float, gain: float, fs_hz: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator, [3] each, of the digital resonator."""
    radians = 2 * math.pi * frequency_hz / fs_hz
    decay = math.exp(-damping_ratio * radians)
    turn = radians * math.sqrt(1 - damping_ratio**2)
    denominator = np.array([1.0, -2 * decay * math.cos(turn), decay**2])
    ratio = np.linspace(0.01, FITTED, POINTS) * fs_hz / frequency_hz
    ratio = np.sort(np.append(ratio, 1.0))
    delays = np.exp(-1j * radians * np.outer(ratio, np.arange(3)))
    wanted = gain * ratio**2 / (ratio**2 - 1 - 2j * damping_ratio * ratio)
    poles = delays @ denominator
    rows = delays / poles[:, None]
    numerator, *_ = np.linalg.lstsq(np.vstack((rows.real, rows.imag)), np.append(wanted.real, wanted.imag), rcond=None)
    return np.asarray(numerator), denominator
