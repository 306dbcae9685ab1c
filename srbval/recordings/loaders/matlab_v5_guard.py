"""Check of a MATLAB v5 file before a library reads it: nothing may claim more than the file holds.

Layout: MATLAB "MAT-File Format", MathWorks, chapter 1 (tag of type and byte count; type 14 is an array,
type 15 a zlib stream holding one element).
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import BinaryIO

from srbval.errors import DataError
from srbval.recordings.loaders.limits import check_claim

HEADER_BYTES = 128
MI_MATRIX = 14
MI_COMPRESSED = 15


def check_structure(path: Path) -> None:
    """Refuse (`DataError`) a file whose elements do not fit into it or claim too much when expanded."""
    size = path.stat().st_size
    if size < HEADER_BYTES + 8:
        raise DataError(f"{path}: truncated MATLAB v5 file ({size} bytes; its header has {HEADER_BYTES}).")
    with path.open("rb") as stream:
        header = stream.read(HEADER_BYTES)
        order = ">" if header[126:128] == b"MI" else "<"
        claimed = 0
        while stream.tell() < size - 7:
            kind, count = struct.unpack(order + "II", stream.read(8))
            start = stream.tell()
            if start + count > size:
                raise DataError(
                    f"{path}: truncated MATLAB v5 file: an element of {count} bytes begins at byte {start} "
                    f"of {size}. Copy or download it again."
                )
            if kind not in (MI_MATRIX, MI_COMPRESSED):
                raise DataError(f"{path}: damaged MATLAB v5 file: element type {kind} at byte {start - 8}.")
            claimed += _expanded_bytes(stream, count, order) if kind == MI_COMPRESSED else count
            check_claim(path, claimed, "its contents")
            stream.seek(start + count)


def _expanded_bytes(stream: BinaryIO, count: int, order: str) -> int:
    """Size the compressed element claims, from its first bytes alone."""
    try:
        head = zlib.decompressobj().decompress(stream.read(min(count, 4096)), 8)
    except zlib.error:
        return count  # the reader will say what is wrong
    return struct.unpack(order + "II", head)[1] if len(head) == 8 else count
