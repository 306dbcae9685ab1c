"""Files that are written completely or not at all, hashes of files, and reading of files up to a size limit."""

import contextlib
import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from srbval.errors import ConfigurationError, DataError

PART_SUFFIX = ".srbval-part"
UNFINISHED = re.compile(r"\.(.+)\.[a-z0-9_]{8}" + re.escape(PART_SUFFIX))  # the group is the name of the final file
MAX_FILE_BYTES = 2**21  # a speed profile of 100,000 entries fits; reading more than that as TOML would take seconds


def check_suffix(path: Path, content: str, suffixes: tuple[str, ...]) -> None:
    """Raise `ConfigurationError` if an output file has a suffix other than `suffixes`; `content` names the format."""
    if path.suffix.lower() not in ("", *suffixes):
        raise ConfigurationError(
            f"{path}: the format is {content}, not {path.suffix}; choose the name {path.stem}{suffixes[0]} "
            f"({', '.join(suffixes)})."
        )


@contextlib.contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; the file replaces `path` on success and is removed on failure.

    Data reach the disk before the name changes, so an interruption leaves the old file or none, never half a file.
    Raises `DataError` if the folder cannot be written, the disk is full, or `path` is a device, a pipe or a folder.
    """
    whole = path.absolute()
    try:
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: a device, a pipe or a folder; a file cannot replace it. Choose another name.")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=PART_SUFFIX, dir=path.parent)
        except ValueError as error:  # the name contains a zero byte or half a character
            raise DataError(f"{path}: not a valid file name ({error}).") from None
        os.close(handle)
        part = Path(name)
        try:
            yield part
            with part.open("rb+") as stream:  # Windows cannot sync a file that is opened for reading
                os.fsync(stream.fileno())
            os.umask(mask := os.umask(0))
            part.chmod(0o666 & ~mask)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        other = Path(error.filename) if isinstance(error.filename, str) else path
        if not (other.is_relative_to(whole.parent) or whole.is_relative_to(other.absolute())):  # of another file
            raise
        raise DataError(f"{path}: cannot be written ({error.strerror or error}).") from None


def remove_unfinished(folder: Path, belongs: Callable[[str], bool]) -> None:
    """Remove temporary files of killed processes from `folder`, if `belongs` accepts the name of the intended file."""
    for path in folder.glob(f".*{PART_SUFFIX}"):
        match = UNFINISHED.fullmatch(path.name)
        if match is not None and belongs(match[1]) and path.is_file() and not path.is_symlink():
            path.unlink(missing_ok=True)


def file_sha256(path: Path) -> str:
    """SHA-256 of a file, 64 hexadecimal digits; raises `DataError` if it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None


def read_limited(path: Path, most_bytes: int = MAX_FILE_BYTES) -> bytes:
    """Read a regular file of at most `most_bytes`; raises `DataError` for anything else, such as a pipe or a folder."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise DataError(f"{path}: not a regular file. Check the path.")
        with path.open("rb") as file:
            content = file.read(most_bytes + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise DataError(f"{path}: no such file. Check the path.") from None
    except (OSError, ValueError) as error:  # a path with a NUL or a lone surrogate is a ValueError
        raise DataError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from None
    if len(content) > most_bytes:
        raise DataError(f"{path}: more than {most_bytes} bytes, which is the limit for a file of this kind.")
    return content
