"""The one type in which vibration enters the signal pipeline, whatever its origin."""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.bridges import NotebookObject, load_public, require_xarray
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.times import is_time
from srbval.storage.json_files import to_json

if TYPE_CHECKING:
    import pandas
    import xarray

KIND_ATTRIBUTE, RECORDING_KIND = "srbval_kind", "recording"  # of a file or data set; of one that contains a recording
IN_ARRAYS = ("channels", "speed_signal")  # fields of a recording that a data set contains as variables
SPEED_VARIABLE, SPEED_TIME, SPEED_RATE = "shaft_speed_hz", "shaft_time_s", "shaft_rate_hz"


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
class Recording(SourceFacts, NotebookObject):
    """Vibration of one bearing: `channels`, float64 or if long float32, each [n], all at one rate.

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
    def known_speed(self) -> ShaftSpeed:
        """The speed of the shaft; `ConfigurationError` if none is stated."""
        if self.speed is None:
            raise ConfigurationError(
                f"{self.name}: no shaft speed: neither the file nor its data set states one; give it with --rpm."
            )
        return self.speed

    def part(self, first: int, end: int) -> Recording:
        """Samples `first` to `end` in double precision, with the course of the speed there and its mean."""
        course, speed, channels = self.speed_signal, self.speed, {}
        for name, samples in self.channels.items():
            channels[name] = np.array(samples[first:end], dtype=np.float64)
        if course is not None and speed is not None:
            low, high = (round(place * course.rate_hz / self.fs_hz) for place in (first, end))
            there = course.values_hz[low : high + 1]
            mean_hz = abs(float(np.mean(there)) / float(np.mean(course.values_hz))) * speed.value_hz
            course = replace(course, values_hz=there)
            speed = replace(speed, value_hz=mean_hz, spread_hz=float(np.std(there)))
        return replace(self, channels=channels, speed=speed, speed_signal=course)

    @property
    def samples(self) -> int:
        """Number of samples of each channel."""
        return len(next(iter(self.channels.values())))

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.samples / self.fs_hz

    @property
    def time_s(self) -> FloatArray:
        """Time of each sample [s], [n]; the first is zero."""
        return np.arange(self.samples) / self.fs_hz

    @classmethod
    def from_array(cls, samples: Any, *, fs_hz: float, **asked: Any) -> Recording:
        """Recording of samples [n], or [n, channels], at one rate [Hz]; `asked`: see `recording_from_columns`."""
        recording: Recording = load_public("recording_from_columns")(
            {"signal": np.asarray(samples)}, fs_hz=fs_hz, **asked
        )
        return recording

    @classmethod
    def from_frame(cls, frame: pandas.DataFrame | pandas.Series, **asked: Any) -> Recording:
        """Recording of the numeric columns of a pandas table; `asked`: see `recording_from_columns`.

        Times are a column with such a name, or the index if it is not a plain count of the rows; otherwise state
        `fs_hz`. A title such as ``acc [g]`` states the unit.
        """
        table = frame.to_frame() if frame.ndim == 1 else frame
        if type(table.index).__name__ != "RangeIndex":
            name = str(table.index.name)
            table = table.rename_axis(index=name if is_time(name) else "time").reset_index()
        columns = {str(name): column.to_numpy() for name, column in table.items()}
        recording: Recording = load_public("recording_from_columns")(columns, **asked)
        return recording

    @classmethod
    def from_xarray(cls, data: xarray.Dataset | xarray.DataArray, **asked: Any) -> Recording:
        """Recording of a data set of xarray: of `to_xarray`, of a run file, or any other with a time coordinate.

        Units are the attributes ``units``; `asked`: see `recording_from_columns`.
        """
        whole = data
        if hasattr(data, "to_dataset"):  # an array, of one signal or with the channels along its shorter side
            shorter = min(data.dims, key=data.sizes.__getitem__)
            whole = data.to_dataset(dim=shorter) if data.ndim == 2 else data.to_dataset(name=data.name or "signal")
        along = next((variable.dims[0] for variable in whole.data_vars.values() if variable.dims), None)
        titles = {name: "time" if name == along and not is_time(str(name)) else str(name) for name in whole.variables}
        columns = {titles[name]: variable.to_numpy() for name, variable in whole.variables.items()}
        units = {titles[name]: str(v.attrs["units"]) for name, v in whole.variables.items() if "units" in v.attrs}
        facts = {name: x.item() if isinstance(x, np.number) else x for name, x in whole.attrs.items()}
        recording: Recording = load_public("recording_from_columns")(
            columns, column_units=units, attributes=facts, **asked
        )
        return recording

    def facts(self) -> dict[str, Any]:
        """Attributes of the data set that contains this recording, from which it is read again."""
        stated = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in IN_ARRAYS}
        facts = {KIND_ATTRIBUTE: RECORDING_KIND, "fs_hz": self.fs_hz, "unit": self.unit}
        facts |= {SPEED_RATE: self.speed_signal.rate_hz} if self.speed_signal is not None else {}
        return facts | {"facts": json.dumps(to_json(stated))}

    def to_xarray(self) -> xarray.Dataset:
        """Data set of the channels over ``time_s``, with everything that is known of the record in its attributes.

        `from_xarray` makes the same recording of it, also from a file that ``to_netcdf`` wrote.
        """
        signals: dict[str, Any] = {name: ("time_s", x, {"units": self.unit}) for name, x in self.channels.items()}
        times = {"time_s": ("time_s", self.time_s, {"units": "s"})}
        if (course := self.speed_signal) is not None:
            signals[SPEED_VARIABLE] = (SPEED_TIME, course.values_hz, {"units": "Hz"})
            times[SPEED_TIME] = (SPEED_TIME, np.arange(course.values_hz.size) / course.rate_hz, {"units": "s"})
        data: xarray.Dataset = require_xarray().Dataset(signals, times, self.facts())
        return data

    def to_frame(self) -> pandas.DataFrame:
        """Pandas table of times and channels, one row per sample."""
        import pandas

        return pandas.DataFrame({"time_s": self.time_s, **self.channels})
