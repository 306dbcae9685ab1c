"""Vibration path from the outer ring to the sensor: gains in third octaves, along the load and across it.

The equation is on the page "The path to the sensor" of the theory.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from srbval.arrays import ComplexArray, FloatArray
from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity

SENSOR_ANGLE_RAD = math.pi / 4  # from x to y; Giraudo et al. 2025, Sensors 25, 2419, sect. 5
SENSOR_AXIS = np.array([math.cos(SENSOR_ANGLE_RAD), math.sin(SENSOR_ANGLE_RAD)])  # unit vector
BANDS_HZ = {"500-1500": (500.0, 1500.0), "1400-2800": (1400.0, 2800.0)}  # for simulated and measured signals
HALF_THIRD_OCTAVE = 10**0.05  # from a band's middle to either edge
MAX_BAND_GAP = 1e-3  # largest relative error of the step from the middle of one band to the next


@dataclass(frozen=True, kw_only=True)
class SensorPath(Limited):
    """Gains from outer ring to sensor in adjacent third octaves: `load` along the load, `cross` across it.

    `frequency_hz`: middles of the bands. `u_db`: standard deviation of both gains in each band, empty if unknown;
    `cross_u_db`: standard deviation of `cross` / `load` in all bands, 0 if unknown. `used`: names of the records to
    which the gains were fitted; a model must not be judged by these records.
    """

    frequency_hz: tuple[float, ...] = quantity("frequency", above=0)
    load: tuple[float, ...] = limited(above=0, most=1e6)
    cross: tuple[float, ...] = limited(above=0, most=1e6)
    u_db: tuple[float, ...] = limited(least=0, most=100, default=())
    cross_u_db: float = limited(least=0, most=100, default=0.0)
    source: str
    used: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.frequency_hz)
        if not count or {len(self.load), len(self.cross), len(self.u_db) or count} != {count}:
            raise ConfigurationError(
                f"sensor_path has {count} frequency_hz, {len(self.load)} load, {len(self.cross)} cross and "
                f"{len(self.u_db)} u_db; give each band one of each (u_db may be left out)."
            )
        steps = np.diff(np.log10(self.frequency_hz))
        if np.any(np.abs(10 * steps - 1) > MAX_BAND_GAP):
            raise ConfigurationError(
                "sensor_path frequency_hz must be the middles of adjoining third octaves, each 10^0.1 = 1.2589 times "
                f"the one before; these are not: {', '.join(f'{one:g}' for one in self.frequency_hz)} Hz."
            )

    @property
    def low_hz(self) -> float:
        """Lower edge of the lowest band of the gains [Hz]."""
        return self.frequency_hz[0] / HALF_THIRD_OCTAVE

    @property
    def high_hz(self) -> float:
        """Upper edge of the highest band of the gains [Hz]."""
        return self.frequency_hz[-1] * HALF_THIRD_OCTAVE

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute complex gains along and across the load at each frequency, [2, n]; 1 beyond `low_hz` or `high_hz`."""
        inside = (frequency_hz >= self.low_hz) & (frequency_hz < self.high_hz)
        with np.errstate(divide="ignore"):
            place = np.rint(10 * np.log10(frequency_hz / self.frequency_hz[0]))
        bands = np.clip(place, 0, len(self.load) - 1).astype(int)
        gains = np.array([self.load, 1j * np.array(self.cross)])[:, bands]
        return np.where(inside, gains, 1.0)

    def drawn(self, random: np.random.Generator) -> "SensorPath":
        """Copy the sensor path with gains drawn at random from their uncertainty, `u_db` and `cross_u_db`."""
        off = 10 ** (np.array(self.u_db or (0.0,) * len(self.load)) * random.standard_normal(len(self.load)) / 20)
        ratio = 10 ** (self.cross_u_db * random.standard_normal() / 20)
        load, cross = np.array([self.load, self.cross]) * off
        return replace(self, load=tuple(load.tolist()), cross=tuple((ratio * cross).tolist()))


def parts_along_sensor(acceleration: FloatArray, load_direction_rad: float) -> FloatArray:
    """Split the component of `acceleration` along the sensor's axis into two parts, [n, 2], whose sum it is.

    `acceleration`: in x, y and perhaps z, [n, 2 or 3]. The first part is due to the motion along the load, the second
    to the motion across it.
    """
    angle = load_direction_rad
    axes = np.array([(math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))])
    return acceleration[:, :2] @ axes.T * (axes @ SENSOR_AXIS)
