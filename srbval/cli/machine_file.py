"""Machine file: settings shared by all records of one machine.

A TOML file with a `title` and any of these: `bearing` (a known name, a file, or a table as in a bearing file),
`[set_point]`, `[sensor]`, `[baseline]` and `[limits]`, whose keys are the fields of `SetPoint`, `Sensor`,
`BaselineRecords` and `MachineLimits`. Paths are relative to the file. Options on the command line override the file.
"""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields
from pathlib import Path
from typing import Any

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError
from srbval.monitoring.trend import LEAST_BASELINE, zone_boundaries
from srbval.recordings import Origin, RecordingSettings
from srbval.storage.tables import UNIT_FACTORS, Limited, build, limited, read_toml, without_unit

BELONGS_TO = {  # option on the command line that discards the machine's value
    "rpm_tolerance": "rpm",
    "scale": "unit",
    "sensitivity": "unit",
    "pulses_per_rev": "tacho",
    "healthy_scale": "healthy",
    "band": "auto_band",
    "auto_band": "band",
    "zones_mm_s": "machine_class",
}


def _option(name: str, unit: str = "", dimension: str = "", **limits: float) -> Any:
    """Field that sets the option `name` (in `unit`); `dimension` as in `quantity`, `limits` as in `limited`."""
    of_quantity = {"dimension": dimension} if dimension else {}
    return limited(metadata={"option": (name, unit)} | of_quantity, default=None, **limits)


@dataclass(frozen=True, kw_only=True)
class SetPoint(Limited):
    """Shaft speed [rad/s] and loads [N] of the machine; the speed counts as measured if no tolerance is given."""

    speed_rad_s: float | None = _option("rpm", "rpm", "speed", above=0)
    speed_tolerance_pct: float | None = _option("rpm_tolerance", above=0, most=10)
    radial_n: float | None = _option("radial_kn", "kN", "force")
    axial_n: float | None = _option("axial_kn", "kN", "force")


@dataclass(frozen=True, kw_only=True)
class Sensor(Limited):
    """Channel, sampling rate, unit, tachometer, origin (measured or simulated) of records; see `RecordingSettings`."""

    channel: str | None = None
    rate_hz: float | None = _option("fs", "Hz", "frequency", above=0)
    unit: str | None = None
    scale: float | None = limited(above=0, default=None)
    sensitivity_mv_per_g: float | None = _option("sensitivity", above=0)
    tacho: str | None = None
    pulses_per_rev: float | None = limited(above=0, default=None)
    origin: Origin | None = None
    resample_hz: float | None = _option("resample", "Hz", "frequency", above=0)
    skip_s: float | None = _option("skip", "s", "time", least=0)
    derivative: int | None = limited(least=1, most=2, default=None)
    cage_channel: str | None = None
    shaft_channel: str | None = None


@dataclass(frozen=True, kw_only=True)
class BaselineRecords(Limited):
    """Healthy record for comparison, its scale factor, and how many first `records` of a trend count as normal."""

    healthy: Path | None = None
    healthy_scale: float | None = limited(above=0, default=None)
    records: int | None = _option("baseline", least=LEAST_BASELINE)


@dataclass(frozen=True, kw_only=True)
class MachineLimits(Limited):
    """Frequency band and largest cage slip of the search for fault lines; boundaries of vibration severity zones.

    `zones_m_s` are the RMS velocities [m/s] at which zones B, C and D begin; they replace those of ISO 20816-3
    for the `machine_class`.
    """

    band_hz: tuple[float, float] | None = _option("band", "Hz", "frequency", above=0)
    auto_band: bool | None = None
    cage_slip_pct: float | None = _option("cage_slip", above=0, most=5)
    machine_class: str | None = None
    zones_m_s: tuple[float, float, float] | None = _option("zones_mm_s", "mm/s", "velocity", above=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        zone_boundaries(self.machine_class)
        for name, values in (("band", self.band_hz), ("zones", self.zones_m_s)):
            if values is not None and list(values) != sorted(set(values)):
                raise ConfigurationError(f"limits {name} = {list(values)} in SI units: the values must increase.")


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Machine file: settings shared by all records of one machine."""

    title: str
    bearing: str | Mapping[str, Any] | None = None
    set_point: SetPoint = field(default_factory=SetPoint)
    sensor: Sensor = field(default_factory=Sensor)
    baseline: BaselineRecords = field(default_factory=BaselineRecords)
    limits: MachineLimits = field(default_factory=MachineLimits)


def machine_options(path: str | Path) -> dict[str, Any]:
    """Read a machine file; return its settings by the names of the command-line options, such as ``rpm_tolerance``.

    Raises `ConfigurationError`, which names the file, for an unknown key or a value of a wrong type, unit or range;
    `DataError` if the file cannot be read.
    """
    file = Path(path)
    try:
        machine = build(Machine, read_toml(file), str(file))
        options = {
            name: _in_unit(value, one, unit)
            for table, one, name, unit in _fields()
            if (value := getattr(getattr(machine, table), one.name)) is not None
        }
        if machine.bearing is not None:
            name = machine.bearing if isinstance(machine.bearing, str) else file.name
            options["bearing"] = str(file.parent / name) if name.endswith(".toml") else name
            load_bearing(options["bearing"])
        if "healthy" in options:
            options["healthy"] = str(file.parent / options["healthy"])
        RecordingSettings(unit=options.get("unit"))
    except ConfigurationError as error:
        said = str(error)
        raise type(error)(said if said.startswith(str(file)) else f"{file}: {said}") from None
    return options


def machine_toml(title: str, options: Mapping[str, Any], folder: Path) -> str:
    """Convert command-line `options` to the text of a machine file; paths in it are relative to its `folder`."""
    stated = {"title": title} | {name: value for name, value in options.items() if value not in (None, False)}
    for name in ("bearing", "healthy"):
        if name in stated and (name == "healthy" or stated[name].endswith(".toml")):
            stated[name] = os.path.relpath(stated[name], folder)
    tables = {"": [f"{name} = {json.dumps(stated[name])}" for name in ("title", "bearing") if name in stated]}
    for table, one, name, unit in _fields():
        if (value := stated.get(name)) is not None:
            if unit:
                value = [f"{x:.12g} {unit}" for x in value] if isinstance(value, list) else f"{value:.12g} {unit}"
            tables.setdefault(f"\n[{table}]", []).append(f"{without_unit(one)} = {json.dumps(value)}")
    return "\n".join(line for head, rows in tables.items() for line in (head, *rows) if line) + "\n"


def _fields() -> Iterator[tuple[str, Field[Any], str, str]]:
    """Yield the table and field of each key of a machine file, the option that the key sets, and the option's unit."""
    for table in fields(Machine):
        if isinstance(table.default_factory, type):
            for one in fields(table.default_factory):
                yield table.name, one, *one.metadata.get("option", (one.name, ""))


def _in_unit(value: Any, field: Field[Any], unit: str) -> Any:
    if unit and isinstance(value, tuple):
        return [_in_unit(one, field, unit) for one in value]
    return float(f"{value / UNIT_FACTORS[field.metadata['dimension']][unit]:.12g}") if unit else value
