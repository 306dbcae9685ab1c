"""The SHA-256 of a file's content at its own end, behind a summary for those who need no more of it.

HDF5 readers ignore what follows the end that an HDF5 file states, so files with a checksum are HDF5 files to everybody.
"""

import hashlib
import os
import re
from pathlib import Path

from srbval.errors import DataError

CHECKSUM = "srbval_checksum"  # attribute of the HDF5 files that have one
MARK = b"\nsrbval summary %07d sha256 "  # after the summary, with its length [bytes]; then the digest and a line end
END = re.compile(rb"\nsrbval summary ([0-9]{7}) sha256 ([0-9a-f]{64})\n")
END_BYTES = len(MARK % 0) + 65
BLOCK_BYTES = 2**20


def append_checksum(path: Path, summary: bytes = b"") -> None:
    """Append `summary` and the checksum of all before it to a file that is being written."""
    with path.open("r+b") as stream:
        digest = hashlib.file_digest(stream, "sha256")
        last = summary + MARK % len(summary)
        digest.update(last)
        stream.seek(0, os.SEEK_END)
        stream.write(last + digest.hexdigest().encode() + b"\n")


def checked_summary(path: Path) -> bytes | None:
    """The summary of a file that is as it was written; None for a file without a checksum, which is not read further.

    Raises `DataError` for a file that is not as it was written, `OSError` where it cannot be read.
    """
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
