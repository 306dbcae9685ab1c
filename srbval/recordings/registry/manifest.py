"""The manifest: an entry for each registered file, in a JSON file of the user's home folder."""

from __future__ import annotations

import dataclasses
import enum
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.recording import Origin
from srbval.recordings.settings import RecordingSettings
from srbval.storage.files import remove_unfinished
from srbval.storage.json_files import parse_json, write_json
from srbval.storage.tables import build

SCHEMA_VERSION = 1
HOME_VARIABLE = "SRBVAL_HOME"
LOCK_SECONDS = 30.0
NO_RECORDINGS: dict[str, Any] = {"schema_version": SCHEMA_VERSION, "recordings": []}


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
    """An entry of the manifest; `sha256`, `size_bytes` and `mtime_ns` are those at the first registration, if any.

    `reason` explains every status but ok, and lists the open questions of an ok file. A fact is None if neither the
    file nor the user states it, `cautions` if nothing was read. Files that are used without being registered have an
    entry with `registered` false.
    """

    file: str
    sha256: str = ""
    size_bytes: int = 0
    mtime_ns: int = 0
    status: FileStatus = FileStatus.OK
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
    registered: bool = True

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


def home_folder() -> Path:
    """The folder of the manifest and of downloads: ``$SRBVAL_HOME``, else the platform's folder for user data."""
    if set_by_user := os.environ.get(HOME_VARIABLE):
        return Path(set_by_user).expanduser()
    import platformdirs

    return Path(platformdirs.user_data_dir("srbval"))


def manifest_path() -> Path:
    """Path of the user's manifest, whether it exists or not."""
    return home_folder() / "manifest.json"


def read_manifest() -> Entries:
    """Entries by the paths of their files, none without a manifest; `DataError` for one that cannot be read."""
    path = manifest_path()
    try:
        document = parse_json(path.read_bytes()) if os.path.exists(path) else NO_RECORDINGS
        if document["schema_version"] != SCHEMA_VERSION:
            raise ValueError(f"its schema is {document['schema_version']}; {SCHEMA_VERSION} is read")
        entries = [build(RegisteredRecording, table, "recordings") for table in document["recordings"]]
    except (OSError, ValueError, LookupError, TypeError, ConfigurationError) as error:
        raise DataError(
            f"{path}: not a readable manifest of srbval ({error}). Move it away and register your folders again."
        ) from None
    return {entry.file: entry for entry in entries}


def update_manifest(change: Callable[[Entries], Entries]) -> None:
    """Replace the entries of the newest manifest, under a lock, by those that `change` makes of them."""
    import filelock

    path = manifest_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with filelock.FileLock(path.with_suffix(".lock"), timeout=LOCK_SECONDS):
            remove_unfinished(path.parent, path.name.__eq__)
            entries = change(read_manifest())
            write_json(path, NO_RECORDINGS | {"recordings": [entries[file] for file in sorted(entries)]})
    except OSError as error:  # also a lock that another process holds for too long
        raise DataError(
            f"{path}: cannot be written ({error.strerror or error}). Set {HOME_VARIABLE} to a folder that you may "
            "write, or wait until no other srbval is running."
        ) from None
