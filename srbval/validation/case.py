"""Validation case: which simulated signals are compared with which measured signals, with which tolerances.

The page "Your model against your rig" of the guide shows the TOML file of a case. Its keys are the fields of
`ValidationCase`, the keys of a `[[pair]]` those of `CasePair`: `simulated` and `measured` are each a file, a list of
files (repeats), a pattern such as ``runs/or_*.csv``, or a table with `file` or `scene`, and settings that replace
those in the tables `[simulated]` and `[measured]` of the case.
"""

import dataclasses
import glob
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, bearing_from_table, load_bearing
from srbval.comparison.table6 import CASES_FOLDER, Published
from srbval.errors import ConfigurationError, DataError
from srbval.models.run import Run
from srbval.recordings import Recording, RecordingSettings, recording_from_run
from srbval.recordings.registry import RecordSource, find_shipped, listing, shipped_recordings
from srbval.recordings.settings import settings_of
from srbval.storage.files import atomic_write
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import to_json
from srbval.storage.tables import Limited, build, limited, read_toml, toml_text

USES = ("fit", "withheld", "blind")


@dataclass(frozen=True, kw_only=True)
class Tolerance(Limited):
    """Largest accepted errors, fixed before the comparison: cage ratio [%], levels relative to the fault line [dB].

    A quantity without a tolerance is not judged ``met`` or ``missed``. The table `[uncertainty]` of a case has the same
    keys; there they are the 95 % half widths that the user states for the simulated side.
    """

    cage_pct: float | None = limited(above=0, most=20.0, default=None)
    level_db: float | None = limited(above=0, most=60.0, default=None)


@dataclass(frozen=True, kw_only=True)
class Source(RecordingSettings):
    """Simulated or measured signals of a comparison, and the settings with which they are read.

    `file` contains paths or patterns (in Python also recordings); several files are repeats. ``registered = "torino"``
    selects every registered record of the rig. `scene` (a name or a TOML file) is simulated at the measured speed and
    load, by `model`, such as ``mine.py:simulate``, or by the scene's own model.
    """

    file: tuple[str, ...] | None = None
    registered: str | None = None
    scene: str | None = None
    model: str | None = None

    @property
    def settings(self) -> RecordingSettings:
        """Settings with which each file is read."""
        return RecordingSettings(**{one.name: getattr(self, one.name) for one in dataclasses.fields(RecordingSettings)})


@dataclass(frozen=True, kw_only=True)
class CasePair:
    """Comparison of simulated with measured signals; the bearing's `state` is by default read from the files."""

    state: Fault | None = None
    simulated: Source | None = None
    measured: Source | None = None
    used_for: str = "withheld"
    how: str = "as the case states"  # how the two sides were paired

    def __post_init__(self) -> None:
        if self.used_for not in USES:
            raise ConfigurationError(f"pair used_for = {self.used_for!r} must be one of {', '.join(USES)}.")
        if self.simulated is None and self.measured is None:
            raise ConfigurationError("a pair names neither a simulated nor a measured side; give at least one.")


@dataclass(frozen=True, kw_only=True)
class ValidationCase:
    """Validation case, with the keys of its TOML file; `pair` contains the comparisons.

    `path` is the case's own file, to whose folder other files are relative; None if the case was not read from a file.
    """

    pair: tuple[CasePair, ...] = ()
    title: str = "Simulated against measured"
    bearing: str | None = None
    elements: Mapping[str, Any] | None = None
    orders: Mapping[str, Any] | None = None
    simulated: Source = Source()
    measured: Source = Source()
    tolerance: Tolerance = Tolerance()
    uncertainty: Tolerance = Tolerance()
    published: tuple[Published, ...] = ()
    path: Path | None = None

    @property
    def folder(self) -> Path:
        """Folder to which file names are relative."""
        return Path() if self.path is None else self.path.parent

    @cached_property
    def known_bearing(self) -> Bearing:
        """Bearing of the case; raises `ConfigurationError` if it is unknown or stated more than once."""
        tables = {kind: table for kind in ("elements", "orders") if (table := getattr(self, kind)) is not None}
        if len(tables) + (self.bearing is not None) > 1:
            raise ConfigurationError(
                f"{self.path or 'case'}: give one of bearing, [elements] and [orders], not several."
            )
        if tables:
            return bearing_from_table({"title": self.title, "source": "the case"} | tables, str(self.path or "case"))
        return load_bearing(self.beside(self.bearing or DEFAULT_BEARING))

    def beside(self, name: str) -> str:
        """Path of a file in the folder of the case; a name without such a file is returned unchanged."""
        return str(self.folder / name) if name and (self.folder / name).is_file() else name

    def side(self, pair: CasePair, name: str) -> Source | None:
        """Signals and settings of a pair's side ``simulated`` or ``measured``; the case's settings are defaults."""
        own, defaults = getattr(pair, name), getattr(self, name)
        return None if own is None else own.over(defaults)


def load_case(name_or_path: str | Path, changes: Mapping[str, Any] | None = None) -> ValidationCase:
    """Load a case from its TOML file, or a bundled case by its name.

    `changes` replaces values of the file by dotted key, such as ``measured.channel``. Raises `ConfigurationError` for
    an unknown key or an impossible value, `DataError` for a missing file.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        bundled = sorted(shipped_folder(CASES_FOLDER).glob("*.toml"))
        known = {one.stem: one for one in bundled if "pair" in read_toml(one)}
        if str(name_or_path) not in known:
            raise ConfigurationError(f"case {str(name_or_path)!r}: give a TOML file, or one of {', '.join(known)}.")
        path = known[str(name_or_path)]
    return _build_case(read_toml(path), changes, path)


def case_of_pairs(pairs: Sequence[Mapping[str, Any]], changes: Mapping[str, Any] | None = None) -> ValidationCase:
    """Build a case from tables `[[pair]]` of simulated and measured signals; `changes` as in `load_case`."""
    return _build_case({"pair": [dict(pair) for pair in pairs]}, changes, None)


def case_of_signals(
    simulated: Any,
    measured: Any,
    changes: Mapping[str, Any] | None = None,
    *,
    state: str | None = None,
    bearing: Bearing | str | Path | None = None,
) -> ValidationCase:
    """Build a case of one comparison from files, recordings or runs; default: bearing and state of the recordings."""
    stated = build(ValidationCase, _changed({}, changes), "changes")
    named = bearing or stated.bearing or stated.elements or stated.orders
    pair: dict[str, Any] = {"state": settings_of({"state": state}).state}
    for side, given in (("simulated", simulated), ("measured", measured)):
        listed = [given] if isinstance(given, RecordSource) else given
        held = [recording_from_run(one) if isinstance(one, Run) else one for one in listed]
        known = [one for one in held if isinstance(one, Recording)]
        named = named or next((own for one in known if (own := one.own_bearing or one.bearing)), None)
        files: Any = tuple(one if isinstance(one, Recording) else str(find_shipped(one)) for one in held)
        pair[side] = Source(file=files) if files else None
    name, own = str(named) if isinstance(named, str | Path) else None, named if isinstance(named, Bearing) else None
    orders = {"rolling_elements": own.rolling_elements} | vars(own.orders) if own else stated.orders
    return dataclasses.replace(stated, pair=(CasePair(**pair),), bearing=name, orders=orders)


def _changed(document: dict[str, Any], changes: Mapping[str, Any] | None) -> dict[str, Any]:
    """Write the `changes`, by dotted key, into the table of a case, and return the table."""
    for key, value in (changes or {}).items():
        table, _, name = key.rpartition(".")
        owner = document.setdefault(table, {}) if table else document
        if not isinstance(owner, dict):
            raise ConfigurationError(f"{key}: {table!r} of the case is not a table; change {table!r} as a whole.")
        owner[name] = value
    return document


def _build_case(document: dict[str, Any], changes: Mapping[str, Any] | None, path: Path | None) -> ValidationCase:
    where = "case" if path is None else str(path)
    if "path" in document:
        raise ConfigurationError(f"{where}: unknown key 'path'.")
    _changed(document, changes)
    for pair in document["pair"] if isinstance(document.get("pair"), list) else ():
        for side in ("simulated", "measured"):
            if isinstance(pair, dict) and side in pair:
                pair[side] = _source_table(pair[side])
    case = dataclasses.replace(build(ValidationCase, document, where), path=path)
    if not case.pair:
        raise ConfigurationError(
            f"{where}: no [[pair]] states what is compared; add one with the keys simulated and measured."
        )
    assert case.known_bearing, "an unknown bearing is refused while the case is read"
    return case


def _source_table(raw: Any) -> Any:
    """Convert a file name or list of file names to a table with the list ``file``; in a table, make ``file`` a list."""
    table = raw if isinstance(raw, dict) else {"file": raw}
    return table | {"file": [table["file"]]} if isinstance(table.get("file"), str) else table


def files_of_source(source: Source, folder: Path, side: str) -> tuple[Path, ...]:
    """Find files by path, pattern or start of a registered file's name; `DataError` for an unknown or ambiguous one."""
    names = (name for name in source.file or () if isinstance(name, str))
    return tuple(Path(file) for name in names for file in _find_files(name, folder, side))


def _find_files(name: str, folder: Path, side: str) -> Sequence[str]:
    path = str(folder / name)
    if os.path.isfile(path):
        return [path]
    if glob.has_magic(name):
        if found := sorted(glob.glob(path)):
            return found
        raise DataError(f"{side} side: no file fits the pattern {name!r} in {folder.resolve()}.")
    registers = (listing().recordings, shipped_recordings())  # the user's own recordings first
    named = ([one.file for one in register if Path(one.file).name.startswith(name)] for register in registers)
    found = list(dict.fromkeys(next(filter(None, named), ())))
    if len(found) != 1:
        many = f"; {len(found)} registered recordings begin so: {', '.join(found[:3])}" if found else ""
        raise DataError(f"{side} side: no file {path!r}{many}. Give the path of a file.")
    return found


def write_case(case: ValidationCase, path: Path) -> None:
    """Write a case as a TOML file that `load_case` reads back unchanged."""
    with atomic_write(path) as part:
        part.write_text(toml_text(to_json(dataclasses.replace(case, path=None))), encoding="utf-8")
