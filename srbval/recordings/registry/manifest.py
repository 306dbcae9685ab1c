"""Registered files, their list as the `data` commands report it, and the manifest that keeps them."""

from __future__ import annotations

import dataclasses
import enum
import itertools
import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.recording import Origin
from srbval.recordings.settings import RecordingSettings
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.json_files import parse_json, to_json
from srbval.storage.tables import build

SCHEMA_VERSION = 1
HOME_VARIABLE = "SRBVAL_HOME"
LOCK_SECONDS = 30.0
POINT = ("state", "radial_kn", "axial_kn", "nominal_rpm", "files")  # of a data set's grid [kN, rpm]


class FileStatus(enum.StrEnum):
    """State of a file compared with its entry."""

    OK = "ok"
    CHANGED = "changed"
    MISSING = "missing"
    TRUNCATED = "truncated"
    UNREADABLE = "unreadable"
    NO_RECORDING = "no recording"  # never registered: a licence, a report, a result of a campaign


@dataclass(frozen=True, kw_only=True)
class RegisteredRecording:
    """An entry of the register; `sha256`, `size_bytes` and `mtime_ns` are those at the first registration.

    `reason` explains every status but ok, and lists the open questions of an ok file. A fact is None if neither the
    file nor the user states it, `cautions` if nothing was read.
    """

    file: str
    sha256: str
    size_bytes: int
    mtime_ns: int
    status: FileStatus
    reason: str | None = None
    format: str | None = None
    origin: Origin | None = None
    dataset: str | None = None
    state: Fault | None = None
    radial_kn: float | None = None
    axial_kn: float | None = None
    nominal_rpm: float | None = None
    fs_hz: float | None = None
    seconds: float | None = None
    rpm: float | None = None
    bearing: str | None = None
    channels: tuple[str, ...] = ()
    channel: str | None = None
    settings: RecordingSettings | None = None
    cautions: tuple[str, ...] | None = None

    @property
    def operating_point(self) -> tuple[Fault | None, float | None, float | None, float | None]:
        """State, radial and axial load [kN], nominal speed [rpm]."""
        return self.state, self.radial_kn, self.axial_kn, self.nominal_rpm

    def with_status(self, status: FileStatus, reason: str) -> RegisteredRecording:
        """The same file with another status."""
        return dataclasses.replace(self, status=status, reason=reason)


Entries = dict[str, RegisteredRecording]


def without_copies(recordings: Iterable[RegisteredRecording]) -> list[RegisteredRecording]:
    """The first recording of each SHA-256 and settings; files without a hash count as different."""
    found: dict[object, RegisteredRecording] = {}
    for recording in recordings:
        found.setdefault((recording.sha256 or recording.file, recording.settings or None), recording)
    return list(found.values())


class RegisterListing:
    """The register, or the part that a command changed, sorted by file; `unreadable` is the reason why it is empty.

    `left_out` are files that are no recordings; `coverage` lists the points of the grid of each data set present (for
    the rig: the paper's Table 5) with their ok `files`, and the number of `missing` points.
    """

    def __init__(self, recordings: Iterable[RegisteredRecording], unreadable: str = "") -> None:
        self.manifest, self.unreadable = manifest_path(), unreadable
        found = sorted(recordings, key=lambda entry: entry.file)
        self.recordings = tuple(r for r in found if r.status is not FileStatus.NO_RECORDING)
        self.left_out = tuple(r for r in found if r.status is FileStatus.NO_RECORDING)
        self.coverage = tuple(self._covered())

    def _covered(self) -> Iterable[dict[str, Any]]:
        files: dict[tuple[object, ...], list[str]] = {}
        for r in self.recordings:
            if r.status is FileStatus.OK:
                files.setdefault((r.dataset, *r.operating_point), []).append(r.file)
        present = {r.dataset for r in self.recordings}
        for name, grid in ((d.name, d.grid) for d in known_datasets() if d.name in present):
            if grid is not None:
                loads = zip(grid.radial_kn, grid.axial_kn, strict=True)
                places = [(s, *load, rpm) for s, load, rpm in itertools.product(grid.states, loads, grid.nominal_rpm)]
                points = [dict(zip(POINT, (*p, files.get((name, *p), [])), strict=True)) for p in places]
                yield {"dataset": name, "points": points, "missing": sum(not point["files"] for point in points)}

    @property
    def problems(self) -> tuple[RegisteredRecording, ...]:
        """Recordings that are not ok."""
        return tuple(r for r in self.recordings if r.status is not FileStatus.OK)

    def to_dict(self) -> dict[str, Any]:
        """The JSON document of `srbval data`."""
        return {
            "schema_version": SCHEMA_VERSION,
            "status": "problems" if self.problems else "ok",
            "manifest": str(self.manifest),
            "recordings": self.recordings,
            "left_out": [{"file": r.file, "reason": r.reason} for r in self.left_out],
            "coverage": self.coverage,
        }


def home_folder() -> Path:
    """The folder of the manifest and of downloads: ``$SRBVAL_HOME``, else the platform's folder for user data."""
    if set_by_user := os.environ.get(HOME_VARIABLE):
        return Path(set_by_user).expanduser()
    import platformdirs

    return Path(platformdirs.user_data_dir("srbval"))


def manifest_path() -> Path:
    """Path of the user's manifest, whether it exists or not."""
    return home_folder() / "manifest.json"


def inspected_path() -> Path:
    """Path of the entries of files that were inspected but never registered, of the same form as the manifest."""
    return home_folder() / "looked-at.json"


def read_manifest(path: Path | None = None) -> Entries:
    """Registered files by path, none without a manifest; `DataError` for a manifest that cannot be read."""
    path = path or manifest_path()
    try:
        document = parse_json(path.read_bytes())
        if document["schema_version"] != SCHEMA_VERSION:
            raise DataError(f"{path}: schema {document['schema_version']} where {SCHEMA_VERSION} is read.")
        entries = [build(RegisteredRecording, _without_nulls(table), "recordings") for table in document["recordings"]]
        if any("\0" in entry.file for entry in entries):
            raise ValueError("a path with a NUL")
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, ConfigurationError) as error:
        raise DataError(
            f"{path}: not a manifest of srbval ({error}). Move it away and register your folders again."
        ) from None
    return {entry.file: entry for entry in entries}


def _without_nulls(values: dict[str, Any]) -> dict[str, Any]:
    return {k: _without_nulls(v) if isinstance(v, dict) else v for k, v in values.items() if v is not None}


def update_manifest(change: Callable[[Entries], None], path: Path | None = None) -> Entries:
    """Apply `change` to the newest manifest under a lock and write it; returns the entries after it."""
    import filelock

    path = path or manifest_path()
    lock = path.with_suffix(".lock")
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        held = filelock.FileLock(lock, timeout=LOCK_SECONDS).acquire()
    except filelock.Timeout:
        raise DataError(f"{lock}: locked by another srbval for {LOCK_SECONDS:.0f} s. Try again later.") from None
    except OSError as error:
        raise DataError(
            f"{lock}: cannot be written ({error.strerror}). Set SRBVAL_HOME to a folder that you may write."
        ) from None
    with held:
        remove_unfinished(path.parent, path.name.__eq__)
        entries = read_manifest(path)
        change(entries)
        document = {"schema_version": SCHEMA_VERSION, "recordings": [entries[key] for key in sorted(entries)]}
        with atomic_write(path) as part:
            part.write_text(json.dumps(to_json(document), indent=1, allow_nan=False), encoding="utf-8")
    return entries
