"""Descriptions of published data sets (`data_manifest/*.toml`) and the rules by which their files are recognised."""

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from srbval.bearing import Fault
from srbval.errors import UnknownNameError
from srbval.recordings.raw import TEXT, RawFile
from srbval.recordings.recording import ShaftSpeed
from srbval.recordings.speed import nominal_speed
from srbval.storage.installation import shipped_folder
from srbval.storage.tables import build, read_toml


@dataclass(frozen=True, kw_only=True)
class MatchRule:
    """Rule that recognises the files of a data set and reads operating conditions from the names of these files.

    The regular expression `file` is searched in a file's name; if `file_required` is true, a file whose name does not
    match is not part of the data set. The named groups of `file` are ``label`` (of the fault), ``rpm`` (nominal speed),
    ``radial_kn``, ``axial_kn``, ``rate_khz`` (sampling rate), ``end`` (motor end with the faulty bearing), ``record``
    (record number) and ``hp`` (motor load). Each regular expression in `variables` must match the name of a variable.
    `columns` lists the permitted numbers of columns of a text table, `vectors` is the required number of arrays.
    """

    file: str | None = None
    file_required: bool = False
    variables: tuple[str, ...] = ()
    columns: tuple[int, ...] = ()
    vectors: int | None = None

    def groups(self, raw: RawFile) -> dict[str, str] | None:
        """Values of the named groups, such as ``label``, for a file; None if the file does not fit this rule."""
        found = re.search(self.file, raw.path.name, re.IGNORECASE) if self.file else None
        if found is None and self.file_required:
            return None
        if self.columns and not (raw.format == TEXT and len(raw.variables) in self.columns):
            return None
        if not all(any(re.fullmatch(p, name) for name in raw.variables) for p in self.variables):
            return None
        if self.vectors is not None and sum(array.size > 1 for array in raw.arrays.values()) != self.vectors:
            return None
        return {key: value for key, value in found.groupdict().items() if value is not None} if found else {}


@dataclass(frozen=True, kw_only=True)
class ChannelRule:
    """Channel of a data set: the variable whose name matches `variable`; if `analyse` is true, the default channel."""

    name: str
    variable: str
    unit: str
    bearing: str | None = None
    analyse: bool = False
    note: str | None = None


@dataclass(frozen=True, kw_only=True)
class PublishedSpeed:
    """Published mean shaft speed [rpm] of the record with this bearing state and nominal motor speed."""

    state: Fault
    nominal_rpm: float
    mean_rpm: float


@dataclass(frozen=True, kw_only=True)
class PublishedSpeeds:
    """Published mean shaft speeds of a data set, over the first `seconds` of each record."""

    source: str
    seconds: float
    means: tuple[PublishedSpeed, ...]


@dataclass(frozen=True, kw_only=True)
class DatasetDescription:
    """Description of a data set: how its files are recognised and interpreted.

    * `reader`: ``variables`` for files of named arrays, ``signal-structs`` for files with one struct per signal.
    * `constants`: facts that hold for all records. `fact_variables`: the variable that contains a fact; ``{record}`` in
      its name stands for the number of the record. Facts are ``label`` (of the fault), ``fs_hz`` (sampling rate),
      ``mean_rpm`` (measured shaft speed), ``rpm`` or ``nominal_hz`` (its set point), ``radial_kn`` or ``radial_lbf``,
      ``axial_kn``. A variable is preferred to the file's name, the name to `records`, and `records` to `constants`.
    * `tachometer_rpm`: variable with a signal of the shaft speed, which is preferred to ``mean_rpm``.
    * `nominal_rpm_by_load`: set points of the speed by motor load. The true speed is within `nominal_ci95_pct` per cent
      of the set point in 95 % of the records.
    * `labels`: regular expressions for fault labels, each with the bearing state that the label denotes.
    * `bands`: demodulation bands with their `reason`; a band with `fs_hz` is valid only for this sampling rate.
    * `records`: label, sampling rate etc. of records number `first` to `last`; `end` is the motor end with the fault.
    * `files`: a file with `url` and `sha256` can be downloaded; `used_for` is ``fit`` if a parameter of the model was
      fitted to the file, ``withheld`` if the file was seen but not used for a fit.
    * `grid`: operating points: each bearing state at each pair of radial and axial load and each nominal speed.
    * `one_rig_a_folder`: true if each folder of the data set contains the records of a different machine.
    """

    name: str
    title: str
    licence: str
    source: str
    url: str
    reader: str = "variables"
    match: MatchRule = MatchRule()
    channels: tuple[ChannelRule, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    fact_variables: Mapping[str, str] = field(default_factory=dict)
    tachometer_rpm: str | None = None
    nominal_rpm_by_load: tuple[float, ...] = ()
    nominal_ci95_pct: float = 1.5
    labels: Mapping[str, Fault] = field(default_factory=dict)
    bands: tuple[Mapping[str, Any], ...] = ()
    published_speeds: PublishedSpeeds | None = None
    records: tuple[Mapping[str, Any], ...] = ()
    files: tuple[Mapping[str, str], ...] = ()
    grid: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()
    one_rig_a_folder: bool = False

    @property
    def operating_points(self) -> tuple[tuple[Fault, float, float, float], ...]:
        """Bearing state, radial load [kN], axial load [kN], nominal speed [rpm] of each point in `grid`."""
        if (grid := self.grid) is None:
            return ()
        states, loads = map(Fault, grid["states"]), list(zip(grid["radial_kn"], grid["axial_kn"], strict=True))
        return tuple((state, *load, rpm) for state in states for load in loads for rpm in grid["nominal_rpm"])

    def band_hz(self, fs_hz: float) -> tuple[float, float] | None:
        """First demodulation band in `bands` [Hz] that is valid for this sampling rate; None if there is none."""
        return next(((b["low_hz"], b["high_hz"]) for b in self.bands if b.get("fs_hz", fs_hz) == fs_hz), None)

    def set_point(self, nominal_rpm: float | None) -> ShaftSpeed | None:
        """Shaft speed from the set point `nominal_rpm`; None without a set point."""
        return None if nominal_rpm is None else nominal_speed(nominal_rpm, self.nominal_ci95_pct)

    def state_of(self, label: str | None) -> Fault | None:
        """Bearing state for the fault label of a file; None if no pattern of `labels` matches it."""
        rules = self.labels.items() if label is not None else ()
        return next((state for rule, state in rules if re.search(rule, label or "", re.IGNORECASE)), None)


@functools.cache
def known_datasets() -> tuple[DatasetDescription, ...]:
    """Load the descriptions of all data sets, in the order of their file names."""
    paths = sorted(shipped_folder("data_manifest").glob("*.toml"))
    return tuple(build(DatasetDescription, read_toml(path), path.stem) for path in paths)


def dataset(name: str) -> DatasetDescription:
    """Description of the data set with this name; `ConfigurationError` if it is not known."""
    known = {description.name: description for description in known_datasets()}
    if name not in known:
        raise UnknownNameError.of(f"data set {name!r} is not known", name, known)
    return known[name]
