"""Machine file: settings shared by all records of one machine.

A TOML file whose keys are the fields of `Machine`: the settings of a record, as in the table `[measured]` of a case,
and more. Its table `[bearing]` may replace the name of the bearing. Paths are relative to the file. Options on the
command line override the file.
"""

import argparse
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError
from srbval.monitoring.trend import LEAST_BASELINE, zone_boundaries
from srbval.recordings import RecordingSettings
from srbval.recordings.settings import ALIASES
from srbval.storage.json_files import to_json
from srbval.storage.tables import build, limited, read_toml, toml_text

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
OTHER_OPTIONS = ("healthy", "healthy_scale", "baseline", "machine_class", "zones_mm_s")  # named like their keys
KEY_OF_OPTION = ALIASES | {"cage_slip": "cage_slip_pct"} | {name: name for name in OTHER_OPTIONS}


@dataclass(frozen=True, kw_only=True)
class Machine(RecordingSettings):
    """Machine file: settings shared by all records of one machine.

    `healthy` is a healthy record for comparison, `healthy_scale` its scale factor; the first `baseline` records of a
    trend count as normal. `cage_slip_pct` is the largest cage slip in the search for fault lines. `zones_mm_s` are the
    RMS velocities at which zones B, C and D begin; they replace those of ISO 20816-3 for the `machine_class`.
    """

    title: str
    healthy: str | None = None
    healthy_scale: float | None = limited(above=0, default=None)
    baseline: int | None = limited(least=LEAST_BASELINE, default=None)
    cage_slip_pct: float | None = limited(above=0, most=5, default=None)
    machine_class: str | None = None
    zones_mm_s: tuple[float, float, float] | None = limited(above=0, default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        zone_boundaries(self.machine_class)
        if self.zones_mm_s is not None and list(self.zones_mm_s) != sorted(set(self.zones_mm_s)):
            raise ConfigurationError(f"zones_mm_s = {list(self.zones_mm_s)}: the velocities must increase.")


def apply_machine_file(options: argparse.Namespace) -> None:
    """Add the settings of the machine file to `options`; an option given on the command line keeps its value."""
    given = {name for name, value in vars(options).items() if value}
    if options.command == "identify":
        given.add("band")  # its option --band belongs to the path
    for name, value in machine_options(options.machine).items():
        if not given & {name, BELONGS_TO.get(name, name)}:
            setattr(options, name, value)


def machine_options(path: str | Path) -> dict[str, Any]:
    """Read a machine file; return its settings by the names of the command-line options, such as ``rpm_tolerance``.

    Raises `ConfigurationError`, which names the file, for an unknown key or a value of a wrong type or range;
    `DataError` if the file cannot be read.
    """
    file = Path(path)
    try:
        table = read_toml(file)
        own_bearing = {"bearing": file.name} if isinstance(table.get("bearing"), Mapping) else {}
        stated = to_json(build(Machine, table | own_bearing, str(file)))
        options = {option: stated[key] for option, key in KEY_OF_OPTION.items() if stated[key] is not None}
        options = _convert_paths(options, lambda stated: str(file.parent / stated))
        if "bearing" in options:
            load_bearing(options["bearing"])
    except ConfigurationError as error:
        said = str(error)
        raise type(error)(said if said.startswith(str(file)) else f"{file}: {said}") from None
    return options


def machine_toml(title: str, options: Mapping[str, Any], folder: Path) -> str:
    """Convert command-line `options` to the text of a machine file; paths in it are relative to its `folder`."""
    given = {name: value for name in KEY_OF_OPTION if (value := options.get(name)) is not None and value is not False}
    stated = _convert_paths(given, lambda path: os.path.relpath(path, folder))
    return toml_text({"title": title} | {KEY_OF_OPTION[name]: value for name, value in stated.items()})


def _convert_paths(options: Mapping[str, Any], convert: Callable[[str], str]) -> dict[str, Any]:
    """Convert the healthy record and the bearing, if it is a TOML file; leave all other options unchanged."""
    paths = {name for name in ("healthy", "bearing") if name == "healthy" or str(options.get(name)).endswith(".toml")}
    return {name: convert(value) if name in paths else value for name, value in options.items()}
