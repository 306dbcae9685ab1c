"""Manifest of the register of recordings: a JSON file in `home_folder` with one entry per inspected file."""

from __future__ import annotations

import enum
import functools
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError, NoRecordingError, SrbvalError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.load import read_file
from srbval.recordings.loaders import detect_format
from srbval.recordings.reading import N_PER_KN
from srbval.recordings.recording import Origin
from srbval.recordings.settings import RecordingSettings, open_for_analysis, open_questions
from srbval.recordings.speed import RPM_PER_HZ
from srbval.storage.files import file_sha256
from srbval.storage.json_files import parse_json, write_json
from srbval.storage.sources import content_version
from srbval.storage.tables import build

MANIFEST_SCHEMA = 1
HOME_VARIABLE = "SRBVAL_HOME"
LOCK_SECONDS = 30.0
CAMPAIGN_JSON, RESULTS_FOLDER = "srbval-campaign.json", "cases"  # file and folder within a campaign's folder


class FileStatus(enum.StrEnum):
    """State of a file compared with its entry in the register."""

    OK = "ok"
    CHANGED = "changed"
    MISSING = "missing"
    TRUNCATED = "truncated"
    UNREADABLE = "unreadable"
    NO_RECORDING = "no recording"  # such as a licence, a report, a result of a campaign; never registered


@dataclass(frozen=True, kw_only=True)
class RegisteredRecording:
    """Entry of one recording file in the register, a list of files that the user registered or that were read.

    `registered` is true if the user registered the file; any other entry only saves reading an unchanged file again.
    `sha256` and `size_bytes` are from the first reading. `reason` explains a `status` other than ok. For an ok file it
    lists missing facts that an analysis needs. A fact is None if neither file nor user states it. `cautions` are
    warnings, e.g. of clipped samples.
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
        """Bearing state, radial load [kN], axial load [kN] and nominal speed [rpm]."""
        return self.state, self.radial_kn, self.axial_kn, self.nominal_rpm


EntriesByFile = dict[str, RegisteredRecording]


def without_copies(recordings: Iterable[RegisteredRecording]) -> list[RegisteredRecording]:
    """Keep only the first of all recordings with the same SHA-256 and settings; keep all recordings without SHA-256."""
    found: dict[object, RegisteredRecording] = {}
    for recording in recordings:
        found.setdefault((recording.sha256 or recording.file, recording.settings or None), recording)
    return list(found.values())


def inspect_file(path: Path, settings: RecordingSettings, old: RegisteredRecording | None) -> RegisteredRecording:
    """Create the register's entry for a file, or update its `old` entry.

    If the file cannot be used, `status` is not ok and `reason` explains it; otherwise `reason` lists missing facts. If
    the content has changed since the old entry, only status and reason of the old entry change. An unchanged file is
    read again only if the settings or the program differ.
    """
    entry = old or RegisteredRecording(file=str(path), registered=False)
    try:
        size_bytes, mtime_ns = size_and_time(path)
        if mtime_ns < 0:
            return replace(entry, status=FileStatus.MISSING, reason="the file is no longer there")
        if size_bytes < entry.size_bytes:
            text = f"{size_bytes} bytes instead of the {entry.size_bytes} registered; copy the file again"
            return replace(entry, status=FileStatus.TRUNCATED, reason=text)
        if not path.is_file():
            return replace(entry, status=FileStatus.UNREADABLE, reason="not a regular file")
        sha256 = file_sha256(path)
        if entry.sha256 not in ("", sha256):
            text = (
                f"SHA-256 was {entry.sha256:.12}... when registered and is {sha256:.12}... now; restore the file, or "
                "register it again if it was changed on purpose (`srbval data add --repin`)"
            )
            return replace(entry, status=FileStatus.CHANGED, reason=text)
        if entry.format and entry.status is FileStatus.OK and entry.settings == (settings or None):
            return replace(entry, mtime_ns=mtime_ns)
        entry = replace(entry, size_bytes=size_bytes, mtime_ns=mtime_ns, sha256=sha256, status=FileStatus.OK)
        entry = _describe_contents(entry, path, settings)
    except OSError as error:
        return replace(entry, status=FileStatus.UNREADABLE, reason=f"cannot be read ({error.strerror})")
    except SrbvalError as error:
        text = str(error).removeprefix(f"{path}: ")
        if isinstance(error, NoRecordingError):
            return replace(entry, status=FileStatus.NO_RECORDING, reason=text)
        cut = "truncated: " in text or "truncated file" in text  # from a loader or the HDF5 library
        return replace(entry, status=FileStatus.TRUNCATED if cut else FileStatus.UNREADABLE, reason=text)
    files = (file for known in known_datasets() if known.name == entry.dataset for file in known.files)
    published = {file["name"]: file.get("sha256") for file in files}.get(path.name)
    if published not in (None, entry.sha256):
        return replace(entry, status=FileStatus.CHANGED, reason=f"its SHA-256 is not the published {published:.12}...")
    return entry


def _describe_contents(entry: RegisteredRecording, path: Path, settings: RecordingSettings) -> RegisteredRecording:
    """Add the contents of a file to its `entry`; `reason` lists the facts that an analysis needs besides."""
    reading = read_file(path, settings)
    questions = *open_questions(reading), *open_for_analysis(reading)
    return replace(
        entry,
        reason=f"not stated: {'; '.join(map(str, questions))}" if questions else None,
        format=detect_format(path).name,
        radial_kn=None if reading.radial_n is None else reading.radial_n / N_PER_KN,
        axial_kn=None if reading.axial_n is None else reading.axial_n / N_PER_KN,
        rpm=None if reading.speed is None else reading.speed.value_hz * RPM_PER_HZ,
        seconds=None if reading.fs_hz is None else len(reading.main.samples) / reading.fs_hz,
        channels=tuple(reading.channels),
        settings=settings or None,
        cautions=reading.all_cautions(),
        **{key: getattr(reading, key) for key in ("origin", "dataset", "nominal_rpm", "fs_hz", "channel")},
        **{key: getattr(reading.main, key) for key in ("state", "bearing")},
    )


def size_and_time(path: str | Path) -> tuple[int, int]:
    """Size [bytes] and modification time [ns] of a file; 0 and -1 if the file cannot be accessed."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):  # ValueError: a path that no file can have
        return 0, -1
    return found.st_size, found.st_mtime_ns


def is_unchanged(entry: RegisteredRecording) -> bool:
    """True if the file still has the size and the modification time stored in its entry."""
    return size_and_time(entry.file) == (entry.size_bytes, entry.mtime_ns)


def home_folder() -> Path:
    """Folder of the manifest and of downloads: ``$SRBVAL_HOME``, otherwise the platform's folder for user data."""
    if set_by_user := os.environ.get(HOME_VARIABLE):
        return Path(set_by_user).expanduser()
    import platformdirs

    return Path(platformdirs.user_data_dir("srbval"))


def manifest_path() -> Path:
    """Path of the user's manifest, whether it exists or not."""
    return home_folder() / "manifest.json"


def read_manifest() -> EntriesByFile:
    """Read the manifest, a list of recording files, as entries by path; `DataError` if the manifest is damaged.

    The list also has entries of files that were only read, not registered; they are left out if their files changed.
    Files that another version of the program has read are to be read again.
    """
    path = manifest_path()
    try:
        entries = _parse_manifest(path.read_bytes()) if os.path.exists(path) else ()
    except (OSError, ValueError, LookupError, TypeError, ConfigurationError) as error:
        raise DataError(
            f"{path}: not a readable manifest of srbval ({error}). Move it away and register your folders again."
        ) from None
    return {entry.file: entry for entry in entries if entry.registered or is_unchanged(entry)}


@functools.lru_cache(maxsize=1)
def _parse_manifest(content: bytes) -> tuple[RegisteredRecording, ...]:
    """Entries in the content of a manifest; cached, because a command may read the manifest for every file."""
    document = parse_json(content)
    if document["schema_version"] != MANIFEST_SCHEMA:
        raise ValueError(f"schema_version = {document['schema_version']} instead of {MANIFEST_SCHEMA}")
    entries = (build(RegisteredRecording, table, "recordings") for table in document["recordings"])
    if document.get("program") != content_version(__name__):
        entries = (replace(entry, mtime_ns=-1, format=None) for entry in entries)  # to be read again
    return tuple(entries)


def update_manifest(change: Callable[[EntriesByFile], EntriesByFile]) -> None:
    """Read the manifest under a lock and replace its entries by the entries that `change` returns."""
    import filelock

    path = manifest_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with filelock.FileLock(path.with_suffix(".lock"), timeout=LOCK_SECONDS):
            entries = change(read_manifest())
            about = {"schema_version": MANIFEST_SCHEMA, "program": content_version(__name__)}
            write_json(path, about | {"recordings": [entries[file] for file in sorted(entries)]})
    except OSError as error:  # or another process has locked the manifest for too long
        raise DataError(
            f"{path}: cannot be written ({error.strerror or error}). Set {HOME_VARIABLE} to a folder that you may "
            "write, or wait until no other srbval is running."
        ) from None
