"""HDF5 files of runs and data sets, with names and units that xarray reads, and a checksum at the end.

After its HDF5 part a file contains a summary, which can be read without HDF5, and the SHA-256 of everything before it.
HDF5 readers ignore these bytes. Every data set also has a checksum of HDF5, for other readers.
"""

import contextlib
import hashlib
import io
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.storage.files import atomic_write, check_suffix

CHECKSUM = "srbval_checksum"  # attribute of HDF5 files with a checksum
SUMMARY_FOOTER = b"\nsrbval summary %07d sha256 "  # with the length of the summary [bytes]; the digest and \n follow
END = re.compile(rb"\nsrbval summary ([0-9]{7}) sha256 ([0-9a-f]{64})\n")
FOOTER_BYTES = len(SUMMARY_FOOTER % 0) + 65
HDF5 = "HDF5", (".h5", ".hdf5", ".nc")  # with its suffixes
CHECKED: dict[str, Any] = {"fletcher32": True}  # option of data sets


class _PatientFile(io.FileIO):
    """File that stores its first write error or Ctrl-C and ignores later writes, because an exception crashes HDF5."""

    error: BaseException | None = None

    def write(self, data: Any) -> int:
        """Write all of `data`; after an error write nothing, but report success."""
        rest = memoryview(data)
        try:
            while self.error is None and len(rest):
                rest = rest[super().write(rest) :]
        except (OSError, KeyboardInterrupt) as error:
            self.error = error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the length; after an error do nothing but report success, so that HDF5 can close the file."""
        try:
            return super().truncate(size) if self.error is None else size or 0
        except (OSError, KeyboardInterrupt) as error:
            self.error = error
            return size or 0


CALLED_BY_HDF5 = {_PatientFile.write.__code__, _PatientFile.truncate.__code__}  # code that a signal must not interrupt


@contextlib.contextmanager
def new_hdf5(path: Path) -> Iterator[Any]:
    """Context with an open HDF5 file, which is moved to `path` on success and ends with a checksum.

    The file's attribute `summary` [bytes] is written before the checksum; its method `check_written` raises an earlier
    write error. Raises the errors of `check_suffix`, and `DataError` if the file cannot be written.
    """
    import h5py

    def check() -> None:
        if raw.error is not None:
            raise raw.error

    check_suffix(path, *HDF5)
    with atomic_write(path) as part:
        with _PatientFile(part, "w+") as raw:
            with h5py.File(raw, "w", track_order=True) as file:
                file.attrs.update({"schema_version": 1, CHECKSUM: "sha256 of the file, after the end of its HDF5 part"})
                file.check_written, file.summary = check, b""
                yield file
            check()
        append_checksum(part, file.summary)


def append_checksum(path: Path, summary: bytes = b"") -> None:
    """Append `summary` to an unfinished file, then the checksum of the whole content."""
    with path.open("r+b") as stream:
        digest = hashlib.file_digest(stream, "sha256")
        last = summary + SUMMARY_FOOTER % len(summary)
        digest.update(last)
        stream.seek(0, os.SEEK_END)
        stream.write(last + digest.hexdigest().encode() + b"\n")


def checked_summary(path: Path) -> bytes | None:
    """Verify a file by its checksum and return its summary, None without checksum; `DataError` if it is damaged."""
    with path.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(0, size - FOOTER_BYTES))
        found = END.fullmatch(stream.read(FOOTER_BYTES))
        if found is None:
            return None
        stream.seek(0)
        digest, left = hashlib.sha256(), size - 65
        while left and (block := stream.read(min(left, 2**20))):
            digest.update(block)
            left -= len(block)
        if left or digest.hexdigest().encode() != found[2]:
            raise DataError(
                f"{path}: damaged: its content does not match its checksum. Copy it again from an undamaged source, "
                "or compute it again."
            )
        length = int(found[1])
        stream.seek(max(0, size - FOOTER_BYTES - length))
        return stream.read(length)
