"""One campaign at a time per folder: the system releases the lock when its process ends, however it ends."""

import contextlib
import os
import platform
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.storage.json_files import parse_json, write_json

LOCK, HOLDER = "lock", "lock-holder.json"
LONGEST = 1000  # bytes about a holder


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[str | None]:
    """Hold `folder` exclusively. Yields who held it last if that process was killed, otherwise None.

    Raises `ConfigurationError` where another process holds it, `DataError` where the folder cannot be written.
    """
    from filelock import FileLock, Timeout

    try:
        folder.mkdir(parents=True, exist_ok=True)
        acquired = FileLock(folder / LOCK, blocking=False).acquire()
    except Timeout:
        raise ConfigurationError(
            f"{folder}: another campaign runs in this folder{_holder(folder)}. Wait for its end "
            f"(srbval campaign status {folder}), or choose another -o."
        ) from None
    except OSError as error:
        raise DataError(
            f"{folder}: cannot be written ({error.strerror}). Choose another folder with -o, or free this one."
        ) from None
    with acquired:
        killed = _holder(folder) or None
        now = datetime.now(UTC).isoformat(timespec="seconds")
        with contextlib.suppress(OSError):  # whom to name is not worth a campaign
            write_json(folder / HOLDER, {"pid": os.getpid(), "host": platform.node(), "since_utc": now})
        try:
            yield killed
        finally:
            with contextlib.suppress(OSError):
                (folder / HOLDER).unlink()


def holder(folder: Path) -> str | None:
    """Who runs a campaign in `folder` now; None where nobody does."""
    from filelock import FileLock, Timeout

    if not (folder / LOCK).exists():
        return None
    try:
        with FileLock(folder / LOCK, blocking=False):
            return None
    except Timeout:
        return _holder(folder) or " (process unknown)"
    except OSError:
        return None


def _holder(folder: Path) -> str:
    """Text about who took the lock last and did not release it; empty where it was released."""
    try:
        file = folder / HOLDER
        written = parse_json(file.read_bytes() if file.is_file() and file.stat().st_size < LONGEST else b"")
        text = f" (process {written['pid']} on {written['host']} since {written['since_utc']})"
        return text if text.isprintable() else " (process unknown)"
    except (OSError, ValueError, KeyError, TypeError):
        return ""
