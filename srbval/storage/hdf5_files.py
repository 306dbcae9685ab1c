"""HDF5 files of runs and data sets, readable by xarray with names and units, and the checksum at their ends.

A file ends with the SHA-256 of its content, behind a summary for those who need no more of it; HDF5 readers ignore what
follows the end that an HDF5 file states. Every data set has a checksum of HDF5's own, for other readers.
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

CHECKSUM = "srbval_checksum"  # attribute of the HDF5 files that have one
SUMMARY_FOOTER = (
    b"\nsrbval summary %07d sha256 "  # after the summary, with its length [bytes]; then the digest and a line end
)
END = re.compile(rb"\nsrbval summary ([0-9]{7}) sha256 ([0-9a-f]{64})\n")
END_BYTES = len(SUMMARY_FOOTER % 0) + 65
BLOCK_BYTES = 2**20
HDF5_SCHEMA_VERSION = 1
HDF5 = "HDF5", (".h5", ".hdf5", ".nc")  # with names that it may have
ATTRIBUTES: dict[str, Any] = {
    "schema_version": HDF5_SCHEMA_VERSION,
    CHECKSUM: "sha256 of the file, after the end of its HDF5 part",
}
CHECKED: dict[str, Any] = {"fletcher32": True}  # option of data sets


class _PatientFile(io.FileIO):
    """A file that keeps its first error of writing, Ctrl-C included, and then only pretends: HDF5 crashes otherwise."""

    error: BaseException | None = None

    def write(self, data: Any) -> int:
        """Write all of `data`, or after an error nothing."""
        rest = memoryview(data)
        try:
            while self.error is None and len(rest):
                rest = rest[super().write(rest) :]
        except (OSError, KeyboardInterrupt) as error:
            self.error = error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        """Set the length; after an error do nothing, but report success, so that HDF5 can close the file."""
        try:
            return super().truncate(size) if self.error is None else size or 0
        except (OSError, KeyboardInterrupt) as error:
            self.error = error
            return size or 0


CALLED_BY_HDF5 = {_PatientFile.write.__code__, _PatientFile.truncate.__code__}  # where no signal is to be taken


@contextlib.contextmanager
def new_hdf5(path: Path) -> Iterator[Any]:
    """An open HDF5 file that becomes `path`, whole and with its checksum, or nothing; it has `ATTRIBUTES`.

    Raises what `check_suffix` raises, and `DataError` if the place cannot be written, which its `check_written` checks
    at any time; its `summary` precedes the checksum.
    """
    import h5py

    def check() -> None:
        if raw.error is not None:
            raise raw.error

    check_suffix(path, *HDF5)
    with atomic_write(path) as part:
        with _PatientFile(part, "w+") as raw:
            with h5py.File(raw, "w", track_order=True) as file:
                file.attrs.update(ATTRIBUTES)
                file.check_written, file.summary = check, b""
                yield file
            check()
        append_checksum(part, file.summary)


def append_checksum(path: Path, summary: bytes = b"") -> None:
    """Append `summary` and the checksum of all before it to a file that is being written."""
    with path.open("r+b") as stream:
        digest = hashlib.file_digest(stream, "sha256")
        last = summary + SUMMARY_FOOTER % len(summary)
        digest.update(last)
        stream.seek(0, os.SEEK_END)
        stream.write(last + digest.hexdigest().encode() + b"\n")


def checked_summary(path: Path) -> bytes | None:
    """The summary of an undamaged file, None for a file without a checksum; `DataError` for a damaged file."""
    with path.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(0, size - END_BYTES))
        found = END.fullmatch(stream.read(END_BYTES))
        if found is None:
            return None
        stream.seek(0)
        digest, left = hashlib.sha256(), size - 65
        while left and (block := stream.read(min(left, BLOCK_BYTES))):
            digest.update(block)
            left -= len(block)
        if left or digest.hexdigest().encode() != found[2]:
            raise DataError(
                f"{path}: damaged: its content does not fit the checksum that was written with it. Copy it again from "
                "where it is whole, or make it again."
            )
        length = int(found[1])
        stream.seek(max(0, size - END_BYTES - length))
        return stream.read(length)
