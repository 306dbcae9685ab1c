"""The one type in which vibration enters the signal pipeline, whatever its origin."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.errors import ConfigurationError, DataError


class Origin(enum.StrEnum):
    """Origin of the signal. Nothing but `MEASURED` is ever shown or counted as measured."""

    MEASURED = "measured"
    SIMULATED = "simulated"
    STAND_IN = "stand-in"


class SpeedSource(enum.StrEnum):
    """Source of a shaft speed, best first."""

    PRESCRIBED = "prescribed"  # the simulation drove the shaft at this speed
    TACHOMETER = "tachometer"  # measured together with the vibration
    STATED = "stated"  # a measured value written in the file or given by the user
    ESTIMATED = "estimated"  # read from the vibration itself: fault harmonics and shaft sidebands
    NOMINAL = "nominal"  # a set point, not measured


@dataclass(frozen=True, kw_only=True)
class ShaftSpeed:
    """Mean shaft speed of a record with the half width of its 95 % interval.

    If the speed was measured over the record, `spread_hz` is its standard deviation and `drift_hz` its change from the
    first to the last quarter.
    """

    value_hz: float
    ci95_hz: float
    source: SpeedSource
    drift_hz: float | None = None
    spread_hz: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedSignal:
    """Shaft speed over a record: `values_hz` [k], evenly at `rate_hz`, the first with the first sample."""

    values_hz: FloatArray
    rate_hz: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceFacts:
    """Facts that the source of a record states; None if it does not.

    `own_bearing` is the bearing stored with a simulated run, `cage_hz` the mean speed of the cage in a simulation.
    `interval_means`: the samples are means over output intervals, as this program's own runs write them.
    `resampling_error` is the estimated error of resampling in the band, as a share of the signal's RMS there. `notes`
    give the source of each fact, `cautions` list what may make the numbers wrong.
    """

    origin: Origin
    dataset: str | None = None
    channel: str | None = None
    axes: tuple[str, str] | None = None
    speed: ShaftSpeed | None = None
    speed_signal: SpeedSignal | None = None
    radial_n: float | None = None
    axial_n: float | None = None
    nominal_rpm: float | None = None
    own_bearing: Bearing | None = None
    cage_hz: float | None = None
    interval_means: bool = False
    resampling_error: float | None = None
    notes: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recording(SourceFacts):
    """Vibration of one bearing: `channels`, float64, each [n], all at one rate.

    `channel` names the one to analyse; a simulated run has two radial `axes` instead, to be rotated onto the sensor's
    direction. `unit` is ``m/s2`` if the source states enough to convert, else its own, else ``unknown``, as with
    `scale_missing` (see `Channel`). `band_hz` is the demodulation band that the data set or the user states.
    """

    name: str
    channels: Mapping[str, FloatArray]
    fs_hz: float
    unit: str
    bearing: str | None = None
    state: Fault | None = None
    band_hz: tuple[float, float] | None = None
    scale_missing: bool = False
    file: str | None = None
    sha256: str | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.fs_hz) and self.fs_hz > 0):
            raise DataError(f"{self.name}: sampling rate {self.fs_hz} Hz must be a positive number.")
        if (self.channel is None) == (self.axes is None):
            raise DataError(f"{self.name}: name either one channel or two axes to analyse.")
        for wanted in (self.channel,) if self.channel is not None else self.axes or ():
            if wanted not in self.channels:
                raise DataError(f"{self.name}: no channel {wanted!r}; it has {', '.join(self.channels)}.")
        lengths = {len(samples) for samples in self.channels.values()}
        if len(lengths) != 1 or 0 in lengths:
            raise DataError(f"{self.name}: channels must have one common, non-zero length; found {sorted(lengths)}.")

    def __repr__(self) -> str:
        state = "" if self.state is None else f", {self.state.label}"
        shown = self.channel or " and ".join(self.axes or ())
        return f"<Recording {self.name}: {self.origin}{state}, {shown}, {self.seconds:.4g} s at {self.fs_hz:g} Hz>"

    @property
    def cage_ratio(self) -> float | None:
        """Mean speed of the cage over that of the shaft, None if either is not known."""
        return None if self.cage_hz is None or self.speed is None else self.cage_hz / self.speed.value_hz

    @property
    def known_speed(self) -> "ShaftSpeed":
        """The speed of the shaft; `ConfigurationError` if none is stated."""
        if self.speed is None:
            raise ConfigurationError(
                f"{self.name}: no shaft speed: neither the file nor its data set states one; give it with --rpm."
            )
        return self.speed

    @property
    def samples(self) -> int:
        """Number of samples of each channel."""
        return len(next(iter(self.channels.values())))

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.samples / self.fs_hz
