"""The manifest file: read whole, written whole, changed by one process at a time."""

import contextlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.registry.entry import SCHEMA_VERSION, RegisteredRecording
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.json_files import parse_json, to_json
from srbval.storage.tables import build

HOME_VARIABLE = "SRBVAL_HOME"
LOCK_SECONDS = 30.0

Entries = dict[str, RegisteredRecording]


def home_folder() -> Path:
    """The folder of the manifest and of downloads: ``$SRBVAL_HOME``, else the platform's folder for user data."""
    set_by_user = os.environ.get(HOME_VARIABLE)
    if set_by_user:
        return Path(set_by_user).expanduser()
    import platformdirs

    return Path(platformdirs.user_data_dir("srbval"))


def manifest_path() -> Path:
    """Path of the user's manifest, whether it exists or not."""
    return home_folder() / "manifest.json"


def inspected_path() -> Path:
    """Path of what is known of files that were inspected, but never registered; same layout as the manifest."""
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
    return {
        key: _without_nulls(value) if isinstance(value, dict) else value
        for key, value in values.items()
        if value is not None
    }


def update_manifest(change: Callable[[Entries], None], path: Path | None = None) -> Entries:
    """Apply `change` to the newest manifest under a lock and write it; returns the entries after it."""
    path = path or manifest_path()
    with _lock(path):
        remove_unfinished(path.parent, path.name.__eq__)
        entries = read_manifest(path)
        change(entries)
        document = {"schema_version": SCHEMA_VERSION, "recordings": [entries[key] for key in sorted(entries)]}
        with atomic_write(path) as part:
            part.write_text(json.dumps(to_json(document), indent=1, allow_nan=False), encoding="utf-8")
    return entries


def _lock(path: Path) -> contextlib.AbstractContextManager[Any]:
    """The manifest's lock, held; the system releases it should the process die."""
    import filelock

    lock = path.with_suffix(".lock")
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        return filelock.FileLock(lock, timeout=LOCK_SECONDS).acquire()
    except filelock.Timeout:
        raise DataError(f"{lock}: locked by another srbval for {LOCK_SECONDS:.0f} s. Try again later.") from None
    except OSError as error:
        raise DataError(
            f"{lock}: cannot be written ({error.strerror}). Set SRBVAL_HOME to a folder that you may write."
        ) from None
