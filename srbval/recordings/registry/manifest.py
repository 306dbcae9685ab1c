"""The manifest file: read whole, written whole, changed by one process at a time."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.registry.entry import SCHEMA_VERSION, RegisteredRecording
from srbval.recordings.registry.home import home_folder
from srbval.storage.whole_file import whole_file

LOCK_SECONDS = 30.0

Entries = dict[str, RegisteredRecording]


def manifest_path() -> Path:
    """Path of the user's manifest, whether it exists or not."""
    return home_folder() / "manifest.json"


def looked_at_path() -> Path:
    """Path of what is known of files that were looked at, but never registered; of the manifest's form."""
    return home_folder() / "looked-at.json"


def read_manifest(path: Path | None = None) -> Entries:
    """Registered files by path, none without a manifest; `DataError` for one not understood."""
    path = path or manifest_path()
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema_version"] != SCHEMA_VERSION:
            raise DataError(f"{path}: schema {document['schema_version']} where {SCHEMA_VERSION} is read.")
        entries = [RegisteredRecording.from_dict(values) for values in document["recordings"]]
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None
    except (ValueError, KeyError, TypeError, AttributeError, ConfigurationError) as error:
        raise DataError(
            f"{path}: not a manifest of srbval ({error}). Move it away and register your folders again."
        ) from None
    return {entry.file: entry for entry in entries}


def update_manifest(change: Callable[[Entries], None], path: Path | None = None) -> Entries:
    """Apply `change` to the newest manifest under a lock and write it; returns the entries after it."""
    path = path or manifest_path()
    with _locked(path):
        for left_over in path.parent.glob(f".{path.name}.*.part"):  # of a process killed while it wrote
            left_over.unlink(missing_ok=True)
        entries = read_manifest(path)
        change(entries)
        document = {
            "schema_version": SCHEMA_VERSION,
            "recordings": [entries[key].to_dict() for key in sorted(entries)],
        }
        with whole_file(path) as part:
            part.write_text(json.dumps(document, indent=1, allow_nan=False), encoding="utf-8")
    return entries


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the manifest's lock; the system releases it should the process die."""
    lock = path.with_suffix(".lock")
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        stream = lock.open("a+b")
    except OSError as error:
        raise DataError(
            f"{lock}: cannot be written ({error.strerror}). Set SRBVAL_HOME to a folder of yours."
        ) from None
    with stream:
        deadline = time.monotonic() + LOCK_SECONDS
        while not _try_lock(stream):
            if time.monotonic() > deadline:
                raise DataError(f"{lock}: held by another srbval for {LOCK_SECONDS:.0f} s. Try again later.")
            time.sleep(0.02)
        yield


def _try_lock(stream: IO[bytes]) -> bool:
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        lock = lambda: msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # noqa: E731
    else:
        lock = lambda: fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)  # noqa: E731
    try:
        lock()
    except OSError:
        return False
    return True
