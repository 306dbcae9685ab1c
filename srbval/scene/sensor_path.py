"""The structure between outer ring and sensor: a direct way and a few modes, as data with their source.

Of a ring that moves with acceleration a as a rigid body would under the force on it, the sensor shows

    A(f) / a(f) = P(f) = d + sum_k g_k f^2 / (f^2 - f_k^2 - 2 i zeta_k f f_k)

Each term of the sum is the acceleration of a mass on a spring and damper that a drives, relative to a (modal
superposition: Ewins 2000, Modal Testing, 2nd ed., sect. 2.5; quoted from memory, not checked). Output-only data give
the product of force and path alone: gains have no unit and say nothing of modal masses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.storage.tables import Checked, limited, quantity

MOST_MODES = 3  # that 2 s of an output can tell apart
DRAWS, SEED = 400, 5  # of the parameters, for what their uncertainty does to a level


@dataclass(frozen=True, kw_only=True)
class PathMode(Checked):
    """A mode: its undamped `frequency_hz`, `damping_ratio`, and `gain`, which may be negative."""

    frequency_hz: float = quantity("frequency", least=1, most=1e6)
    damping_ratio: float = limited(least=1e-4, most=0.99)
    gain: float = limited(least=-1e6, most=1e6)


@dataclass(frozen=True, kw_only=True)
class SensorPath(Checked):
    """A path: the `direct` gain d and up to three `modes`, good within `low_hz` to `high_hz`, and its `source`.

    `covariance` is that of ln d and, mode by mode, ln f, ln zeta, g, [1 + 3 modes, 1 + 3 modes]; empty where nothing is
    known of it. `scatter_db` is what levels scatter by about the path beyond noise. `used` names the records that it
    was identified from: they are fitted, and no verdict may rest on them.
    """

    direct: float = limited(above=0, most=1e6)
    modes: tuple[PathMode, ...] = ()
    low_hz: float = quantity("frequency")
    high_hz: float = quantity("frequency")
    scatter_db: float = limited(least=0, most=100, default=0.0)
    source: str
    used: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        size = 1 + 3 * len(self.modes)
        if self.low_hz >= self.high_hz:
            raise ConfigurationError(f"sensor_path low_hz = {self.low_hz:g} must be below high_hz = {self.high_hz:g}.")
        if len(self.modes) > MOST_MODES:
            raise ConfigurationError(f"sensor_path has {len(self.modes)} modes; the limit is {MOST_MODES}.")
        if self.covariance and [len(row) for row in self.covariance] != [size] * size:
            raise ConfigurationError(f"sensor_path covariance must be {size} rows of {size} numbers.")
        if self.covariance and not self._is_covariance():
            raise ConfigurationError("sensor_path covariance must be finite, symmetric, without negative variances.")

    def _is_covariance(self) -> bool:
        matrix = np.array(self.covariance)
        if not np.isfinite(matrix).all() or not np.allclose(matrix, matrix.T, atol=1e-9 * np.abs(matrix).max()):
            return False
        return bool(np.linalg.eigvalsh(matrix).min() >= -1e-9 * np.abs(matrix).max())

    @property
    def parameters(self) -> FloatArray:
        """ln d and, mode by mode, ln f, ln zeta, g: what `covariance` is of."""
        rows = [(math.log(m.frequency_hz), math.log(m.damping_ratio), m.gain) for m in self.modes]
        return np.array([math.log(self.direct), *(value for row in rows for value in row)])

    def response(self, frequency_hz: FloatArray) -> NDArray[np.complex128]:
        """P at these frequencies, complex."""
        return response(frequency_hz, self.parameters)

    def level_db(self, frequency_hz: FloatArray) -> tuple[FloatArray, FloatArray]:
        """20 log10 |P| [dB], and one standard deviation of it by the parameters' uncertainty."""
        values = self.parameters
        level = 20 * np.log10(np.abs(response(frequency_hz, values)))
        if not self.covariance:
            return level, np.zeros_like(level)
        drawn = np.random.default_rng(SEED).multivariate_normal(values, np.array(self.covariance), size=DRAWS)
        levels = [20 * np.log10(np.abs(response(frequency_hz, one))) for one in drawn]
        return level, np.std(levels, axis=0, ddof=1)

    def deviations(self) -> FloatArray:
        """Standard deviations of `parameters`; zeros where nothing is known."""
        known = np.array(self.covariance) if self.covariance else np.zeros((len(self.parameters),) * 2)
        return np.sqrt(np.diag(known))


def response(frequency_hz: FloatArray, parameters: FloatArray | Sequence[float]) -> NDArray[np.complex128]:
    """P at these frequencies for `SensorPath.parameters`; see the module."""
    found = np.full(np.shape(frequency_hz), math.exp(parameters[0]), dtype=np.complex128)
    for place in range(1, len(parameters), 3):
        own_hz, damping, gain = math.exp(parameters[place]), math.exp(parameters[place + 1]), parameters[place + 2]
        ratio = frequency_hz / own_hz
        found += gain * ratio**2 / (ratio**2 - 1 - 2j * damping * ratio)
    return found
