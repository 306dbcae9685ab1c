"""Writing a file as a whole or not at all."""

import contextlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from srbval.errors import DataError

SUFFIX = ".srbval-part"
UNFINISHED = re.compile(r"\.(.+)\.[a-z0-9_]{8}" + re.escape(SUFFIX))  # the name of the file that was to be written


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it replaces `path` on success and is removed on failure.

    Data reach the disk before the name changes, so an interruption leaves the old file or none, never
    half a one. Raises `DataError` where the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=SUFFIX, dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error.strerror}).") from None
    part = Path(name)
    try:
        yield part
        _sync(part)
        part.chmod(0o666 & ~_umask())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def remove_unfinished(folder: Path, belongs: Callable[[str], bool]) -> None:
    """Remove what killed processes left in `folder` of `whole_file`, for names of files that `belongs` accepts.

    Nothing else: neither files of other names nor folders nor links. Call it where no other process writes.
    """
    for path in folder.glob(f".*{SUFFIX}"):
        match = UNFINISHED.fullmatch(path.name)
        if match is not None and belongs(match[1]) and path.is_file() and not path.is_symlink():
            path.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    with path.open("rb") as stream:
        os.fsync(stream.fileno())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
