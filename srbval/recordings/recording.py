"""The one type in which vibration enters the signal pipeline, whatever its origin."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.errors import DataError


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
    """Mean shaft speed of a record.

    `ci95_hz` is the half width of a 95 % interval [Hz] of the mean over this very record. `spread_hz` is the standard
    deviation over the record and `drift_hz` the change from its first to its last quarter, if the speed was
    measured over the record, else None.
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
    """Facts that the source of a record states; None if it does not. Loads in N, nominal speed in rpm.

    `own_bearing`: the bearing that a simulated run carries, as far as its lines need it. `notes` give the source of
    each fact, `cautions` what may make the numbers wrong, each with a count.
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
    notes: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recording(SourceFacts):
    """Vibration of one bearing, all channels at one rate.

    `channels` maps a channel's name to its samples, float64, shape [n]. `unit` is that of the samples as
    stored here (``m/s2`` wherever the source states enough to convert, else the source's own, else
    ``unknown``). `channel` names the one to analyse; a simulated run names two radial axes in `axes`
    instead, to be rotated onto the sensor's direction. A fact that the source does not state is None.
    `speed_signal` is the signal whose mean is `speed`, if there is one; `band_hz` is the demodulation band that its
    data set declares or the user stated. With `scale_missing` the samples are whole numbers of a converter whose scale
    in the unit given for them nobody has stated: `unit` is ``unknown`` then.
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
    def samples(self) -> int:
        """Number of samples of each channel."""
        return len(next(iter(self.channels.values())))

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.samples / self.fs_hz
