"""One campaign at a time in a folder: a lock that the system lets go of when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import json
import os
import platform
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from srbval.errors import ConfigurationError, DataError

NAME = "lock"


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[str | None]:
    """Hold `folder` alone. Yields who left the lock behind without taking it off (killed), None where nobody did.

    Raises `ConfigurationError` where another process holds it, `DataError` where the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        stream = (folder / NAME).open("a+", encoding="utf-8")
    except OSError as error:
        raise DataError(
            f"{folder}: cannot be written ({error.strerror}). Choose another folder with -o, or free this one."
        ) from None
    with stream:
        if not _take(stream):
            raise ConfigurationError(
                f"{folder}: another campaign runs in this folder{_holder(stream)}. Wait for its end "
                f"(srbval campaign status {folder}), or choose another -o."
            )
        left = _holder(stream) or None
        stream.truncate(0)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        json.dump({"pid": os.getpid(), "host": platform.node(), "since_utc": now}, stream)
        stream.flush()
        try:
            yield left
        finally:
            stream.truncate(0)


def holder(folder: Path) -> str | None:
    """Who runs a campaign in `folder` now; None where nobody does."""
    try:
        with (folder / NAME).open("r+", encoding="utf-8") as stream:
            return None if _take(stream) else _holder(stream) or "somebody"
    except OSError:
        return None


def _take(stream: IO[str]) -> bool:
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        try:
            stream.seek(0)
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        return True
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _holder(stream: IO[str]) -> str:
    """Text about who wrote the lock; empty where nothing is in it."""
    stream.seek(0)
    try:
        written = json.loads(stream.read() or "null")
        return (
            "" if written is None else f" (process {written['pid']} on {written['host']} since {written['since_utc']})"
        )
    except (ValueError, KeyError, TypeError, OSError):
        return ""
