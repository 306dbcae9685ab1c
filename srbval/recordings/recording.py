"""`Recording`, the type in which measured, simulated and synthetic vibration enters the analysis."""

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

KIND_ATTRIBUTE, RECORDING_KIND = "srbval_kind", "recording"  # attribute of a file; its value for a recording
IN_ARRAYS = ("channels", "speed_signal")  # fields that a data set of xarray contains as variables
SPEED_VARIABLE, SPEED_TIME, SPEED_RATE = "shaft_speed_hz", "shaft_time_s", "shaft_rate_hz"


class Origin(enum.StrEnum):
    """Origin of a signal: measured, simulated by a model, or a synthetic stand-in for a measurement."""

    MEASURED = "measured"
    SIMULATED = "simulated"
    STAND_IN = "stand-in"


class SpeedSource(enum.StrEnum):
    """Way in which a shaft speed is known; the most reliable is listed first."""

    PRESCRIBED = "prescribed"  # the simulation drove the shaft at this speed
    TACHOMETER = "tachometer"  # measured together with the vibration
    STATED = "stated"  # a measured value written in the file or given by the user
    ESTIMATED = "estimated"  # read from the vibration itself: fault harmonics and shaft sidebands
    NOMINAL = "nominal"  # a set point, not measured


@dataclass(frozen=True, kw_only=True)
class ShaftSpeed:
    """Mean shaft speed of a record with the half width of its 95 % interval [Hz].

    If the speed was measured during the record, `spread_hz` is the standard deviation of the speed, and `drift_hz` is
    the mean speed in the last quarter of the record minus the mean speed in the first quarter.
    """

    value_hz: float
    ci95_hz: float
    source: SpeedSource
    drift_hz: float | None = None
    spread_hz: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedSignal:
    """Shaft speed during a record: `values_hz` [k], sampled at `rate_hz` from the first vibration sample on."""

    values_hz: FloatArray
    rate_hz: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceFacts:
    """Facts that a file, run or data set states about a record; a fact that is not stated is None.

    `own_bearing` is the bearing stored with a simulated run, `cage_hz` the mean cage speed of a simulation. With
    `interval_means` each sample is the mean over one sampling interval, as in this program's runs. `resampling_error`
    is the estimated error of resampling divided by the signal's RMS, both in the demodulation band. `notes` name the
    source of each fact; `cautions` list reasons why results may be wrong.
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
    """Vibration of one bearing: `channels` maps names to samples [n], all at the sampling rate `fs_hz`.

    Samples are float64, or float32 if the record is long. `channel` is the channel to analyse; a simulated run has two
    radial `axes` instead, from which the signal in the sensor's direction is computed. `unit` is ``m/s2`` (velocities:
    ``mm/s``, displacements: ``um``) if the samples could be converted, otherwise the unit in the file, or ``unknown``.
    With `scale_missing` the file states a unit but not the factor from the samples to this unit. `band_hz` is the
    demodulation band stated by the data set or the user.
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
        """Mean cage speed divided by mean shaft speed; None if either is unknown."""
        return None if self.cage_hz is None or self.speed is None else self.cage_hz / self.speed.value_hz

    @property
    def known_speed(self) -> ShaftSpeed:
        """Shaft speed; raises `ConfigurationError` if none is stated."""
        if self.speed is None:
            raise ConfigurationError(
                f"{self.name}: no shaft speed: neither the file nor its data set states one; give it with --rpm."
            )
        return self.speed

    def part(self, first: int, end: int) -> Recording:
        """Copy samples [`first`, `end`) as float64; a speed signal is cut, and the mean speed recomputed.

        After the end of a speed signal that is shorter than the record its last value is used.
        """
        channels = {name: np.array(samples[first:end], dtype=np.float64) for name, samples in self.channels.items()}
        course, speed = self.speed_signal, self.speed
        if course is not None and speed is not None:
            low, high = (round(place * course.rate_hz / self.fs_hz) for place in (first, end))
            there = course.values_hz[min(low, course.values_hz.size - 1) : high + 1]
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
        """Time of each sample [s], shape [n]; the first is zero."""
        return np.arange(self.samples) / self.fs_hz

    @classmethod
    def from_array(cls, samples: Any, *, fs_hz: float, **stated: Any) -> Recording:
        """Create a recording from samples [n] or [n, channels]; `stated` are fields of `RecordingSettings`."""
        return load_public("recording_from_columns")({"signal": np.asarray(samples)}, fs_hz=fs_hz, **stated)

    @classmethod
    def from_frame(cls, frame: pandas.DataFrame | pandas.Series, **stated: Any) -> Recording:
        """Create a recording from the numeric columns of a pandas table.

        Times are read from a column with a name such as ``time``, or from the index unless it only counts rows;
        otherwise `fs_hz` is required. A title such as ``acc [g]`` states the unit. `stated` are fields of
        `RecordingSettings`.
        """
        table = frame.to_frame() if frame.ndim == 1 else frame
        if type(table.index).__name__ != "RangeIndex":
            name = str(table.index.name)
            table = table.rename_axis(index=name if is_time(name) else "time").reset_index()
        columns = {str(name): column.to_numpy() for name, column in table.items()}
        return load_public("recording_from_columns")(columns, **stated)

    @classmethod
    def from_xarray(cls, data: xarray.Dataset | xarray.DataArray, **stated: Any) -> Recording:
        """Create a recording from an xarray data set with a time coordinate, such as from `to_xarray` or a run file.

        Units are read from the attributes ``units``. `stated` are fields of `RecordingSettings`.
        """
        whole = data
        if hasattr(data, "to_dataset"):  # an array of one signal, or with channels along its shorter dimension
            shorter = min(data.dims, key=data.sizes.__getitem__)
            whole = data.to_dataset(dim=shorter) if data.ndim == 2 else data.to_dataset(name=data.name or "signal")
        along = next((variable.dims[0] for variable in whole.data_vars.values() if variable.dims), None)
        titles = {name: "time" if name == along and not is_time(str(name)) else str(name) for name in whole.variables}
        columns = {titles[name]: variable.to_numpy() for name, variable in whole.variables.items()}
        units = {titles[name]: str(v.attrs["units"]) for name, v in whole.variables.items() if "units" in v.attrs}
        facts = {name: x.item() if isinstance(x, np.number) else x for name, x in whole.attrs.items()}
        return load_public("recording_from_columns")(columns, column_units=units, attributes=facts, **stated)

    def facts(self) -> dict[str, Any]:
        """Attributes that `to_xarray` stores beside the samples, so that `from_xarray` can restore the recording."""
        stated = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in IN_ARRAYS}
        facts = {KIND_ATTRIBUTE: RECORDING_KIND, "fs_hz": self.fs_hz, "unit": self.unit}
        facts |= {SPEED_RATE: self.speed_signal.rate_hz} if self.speed_signal is not None else {}
        return facts | {"facts": json.dumps(to_json(stated))}

    def to_xarray(self) -> xarray.Dataset:
        """Convert to an xarray data set; `from_xarray` restores the recording from it or from its netCDF file."""
        signals: dict[str, Any] = {name: ("time_s", x, {"units": self.unit}) for name, x in self.channels.items()}
        times = {"time_s": ("time_s", self.time_s, {"units": "s"})}
        if (course := self.speed_signal) is not None:
            signals[SPEED_VARIABLE] = (SPEED_TIME, course.values_hz, {"units": "Hz"})
            times[SPEED_TIME] = (SPEED_TIME, np.arange(course.values_hz.size) / course.rate_hz, {"units": "s"})
        return require_xarray().Dataset(signals, times, self.facts())

    def to_frame(self) -> pandas.DataFrame:
        """Convert to a pandas table of times and channels, one row per sample."""
        import pandas

        return pandas.DataFrame({"time_s": self.time_s, **self.channels})
