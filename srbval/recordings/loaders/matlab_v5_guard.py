"""Check of a MATLAB v5 file before a library reads it: nothing may claim more than the file holds.

Layout: MATLAB "MAT-File Format", MathWorks, chapter 1. An element is a tag (type, byte count) and its
data, padded to 8 bytes; type 14 is an array, which holds elements again (flags, dimensions, name, and
data or further arrays); type 15 is a zlib stream that holds one element.
"""

from __future__ import annotations

import math
import mmap
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from srbval.errors import DataError
from srbval.recordings.loaders.limits import check_claim, largest_claim

HEADER_BYTES = 128
MI_MATRIX, MI_COMPRESSED = 14, 15
CELL, STRUCT, OBJECT, CHAR, SPARSE = 1, 2, 3, 4, 5
SIMPLE_CLASSES = (CHAR, *range(6, 16))  # text and numbers: nothing nested
HEAD_BYTES = 4096  # of a compressed element: enough for its flags and dimensions
MAX_DEPTH = 32
MAX_ELEMENTS = 100_000

Element = tuple[int, int, int]  # type, first byte of the data, byte count


def check_structure(path: Path) -> None:
    """Refuse (`DataError`) a file whose elements do not fit into it or claim too much when expanded."""
    size = path.stat().st_size
    if size < HEADER_BYTES + 8:
        raise DataError(
            f"{path}: truncated MATLAB v5 file ({size} bytes; its header has {HEADER_BYTES}). Copy it again."
        )
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        order = ">" if data[126:128] == b"MI" else "<"
        _Guard(path, order).check(data)


class _Guard:
    """Walks the elements of one file and keeps count of what they claim."""

    def __init__(self, path: Path, order: str) -> None:
        self.path = path
        self.order = order
        self.claimed = 0
        self.elements = 0

    def check(self, data: mmap.mmap) -> None:
        for kind, start, count in self._children(data, HEADER_BYTES, len(data)):
            if kind == MI_COMPRESSED:
                self._compressed(data[start : start + count])
            elif kind == MI_MATRIX:
                self._claim(count)
                self._matrix(data, start, count, 0)
            else:
                raise self._damaged(f"element type {kind} at byte {start - 8}")

    def _children(self, data: bytes | mmap.mmap, start: int, stop: int) -> Iterator[Element]:
        """Elements between `start` and `stop`; each must end before `stop`."""
        at = start
        while at + 8 <= stop:
            self.elements += 1
            if self.elements > MAX_ELEMENTS:
                raise self._damaged(f"more than {MAX_ELEMENTS} elements")
            kind, count = struct.unpack(self.order + "II", data[at : at + 8])
            if kind >> 16:  # small element: byte count and data share the tag
                yield kind & 0xFFFF, at + 4, kind >> 16
                at += 8
                continue
            if at + 8 + count > stop:
                raise self._damaged(f"truncated: an element of {count} bytes at byte {at} of {stop}")
            yield kind, at + 8, count
            at += 8 + count + (0 if kind == MI_COMPRESSED else -count % 8)

    def _compressed(self, stream: bytes) -> None:
        """Look at the head of the stream; expand it only where it holds nested arrays."""
        try:
            head = zlib.decompressobj().decompress(stream, HEAD_BYTES)
            if len(head) < 8:
                raise self._damaged("truncated: a compressed element without a tag")
            kind, count = struct.unpack(self.order + "II", head[:8])
            self._claim(count)
            if kind != MI_MATRIX or self._shape(head, 8, count)[0] in SIMPLE_CLASSES:
                return
            body = zlib.decompressobj().decompress(stream, largest_claim(self.path))
        except zlib.error as error:
            raise self._damaged(f"compressed data, {error}") from None
        self._matrix(body, 8, min(count, len(body) - 8), 0)

    def _matrix(self, data: bytes | mmap.mmap, start: int, count: int, depth: int) -> None:
        if depth > MAX_DEPTH:
            raise self._damaged(f"arrays nested deeper than {MAX_DEPTH}")
        if count == 0:
            return
        kind, total = self._shape(data, start, count)
        if kind not in (CELL, STRUCT, OBJECT):
            return
        children = list(self._children(data, start, start + count))
        if kind != CELL and 8 * total * self._fields(data, children) > count:
            raise self._damaged(f"a struct array of {total} elements in {count} bytes")
        for child, at, size in children:
            if child == MI_MATRIX:
                self._matrix(data, at, size, depth + 1)

    def _fields(self, data: bytes | mmap.mmap, children: list[Element]) -> int:
        """Fields of a struct: bytes of its names over the length of one, the element of 4 bytes before."""
        plain = [child for child in children if child[0] != MI_MATRIX]
        (_, at, size), (_, _, names) = plain[-2:] if len(plain) > 1 else ((0, 0, 0), (0, 0, 0))
        length = struct.unpack(self.order + "i", data[at : at + 4])[0] if size == 4 else 0
        return names // length if length > 0 else 1

    def _shape(self, data: bytes | mmap.mmap, start: int, count: int) -> tuple[int, int]:
        """Class and number of elements of an array; more elements than bytes are refused."""
        flags = struct.unpack(self.order + "I", data[start + 8 : start + 12].ljust(4, b"\0"))[0]
        kind = flags & 0xFF
        tag = data[start + 16 : start + 24].ljust(8, b"\0")
        size = struct.unpack(self.order + "II", tag)[1]
        if kind == SPARSE or kind not in (CELL, STRUCT, OBJECT, *SIMPLE_CLASSES) or size > 4 * 32:
            return kind, 0
        raw = data[start + 24 : start + 24 + size // 4 * 4]
        dimensions = struct.unpack(f"{self.order}{len(raw) // 4}i", raw[: len(raw) // 4 * 4])
        total = math.prod(dimensions)
        least = 8 if kind in (CELL, STRUCT, OBJECT) else 1
        if any(d < 0 for d in dimensions) or total * least > count:
            raise self._damaged(f"an array of {' x '.join(map(str, dimensions))} in {count} bytes")
        return kind, total

    def _claim(self, count: int) -> None:
        self.claimed += count
        check_claim(self.path, self.claimed, "its contents")

    def _damaged(self, what: str) -> DataError:
        return DataError(f"{self.path}: truncated or damaged MATLAB v5 file ({what}). Copy it again.")
