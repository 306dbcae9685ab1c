"""What kind of file this is, told by its first bytes and never by its name."""

from __future__ import annotations

import enum
from pathlib import Path

from srbval.errors import DataError

HEAD_BYTES = 4096
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
NPY_SIGNATURE = b"\x93NUMPY"
ACCEPTED = "MATLAB v5 or v7.3, HDF5, NumPy .npy, or a text table"


class FileKind(enum.StrEnum):
    """File formats that have a loader."""

    MATLAB_V5 = "MATLAB v5"
    HDF5 = "HDF5"
    NPY = "NumPy"
    TEXT = "text"


def sniff(path: Path) -> FileKind:
    """Kind of the file at `path`; `DataError` for what is missing, empty or of no known kind."""
    head = _head(path)
    if not head:
        raise DataError(f"{path}: the file is empty (0 bytes). Copy or download it again.")
    if head.startswith(NPY_SIGNATURE):
        return FileKind.NPY
    if any(head[at : at + 8] == HDF5_SIGNATURE for at in (0, 512, 1024, 2048)):
        return FileKind.HDF5
    if head.startswith(b"MATLAB 5.0") or head[124:128] in (b"\x00\x01IM", b"\x01\x00MI"):
        return FileKind.MATLAB_V5
    if _is_text(head):
        return FileKind.TEXT
    raise DataError(f"{path}: starts with {head[:8]!r}, which is no known recording. Accepted: {ACCEPTED}.")


def _head(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise DataError(f"{path}: is a folder, not a recording; `srbval data add {path}` registers it.")
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: is not a regular file.")
        with path.open("rb") as stream:
            return stream.read(HEAD_BYTES)
    except FileNotFoundError:
        raise DataError(f"{path}: no such file. Check the path.") from None
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None
    except ValueError as error:
        raise DataError(f"{str(path)!r}: not a usable path ({error}).") from None


def _is_text(head: bytes) -> bool:
    """Text has no control characters but white space; any 8-bit encoding will do."""
    return not any(byte < 32 and byte not in b"\t\n\r\f" for byte in head)
