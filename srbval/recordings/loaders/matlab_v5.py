"""MATLAB v5 to v7 files, read with every size checked before it is used.

Layout: MATLAB "MAT-File Format", MathWorks, chapter 1. An element is a tag (type, byte count) and its
data, padded to 8 bytes; an array (type 14) holds elements again: flags, dimensions, name, then data or
further arrays; type 15 is a zlib stream of one element. scipy.io.loadmat reads the same files, but a few
flipped bits make it allocate gigabytes or end the process (bus error, scipy 1.17); it serves as the
reference in the tests.
"""

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import FileFormat, RawFile, Value, check_claim, largest_claim

HEADER_BYTES = 128
TITLE, VERSION_AND_ENDIAN = b"MATLAB 5.0", (b"\x00\x01IM", b"\x01\x00MI")  # the latter at bytes 124 to 127
MI_MATRIX, MI_COMPRESSED = 14, 15
CELL, STRUCT, OBJECT, CHAR = 1, 2, 3, 4
NUMERIC_CLASSES = range(6, 16)
COMPLEX_FLAG = 0x0800
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
MAX_DEPTH = 32
MAX_ELEMENTS = 100_000
MAX_TEXT_BYTES = 65536


def load_matlab_v5(path: Path) -> RawFile:
    """Read every numeric array, text and (nested) struct field of a MATLAB v5 file.

    Cells and structs of one element are unwrapped; of larger ones each element's index goes into its name.
    Complex parts, sparse arrays, function handles and Java objects are left out. Raises `DataError`
    whatever the damage.
    """
    data = memoryview(path.read_bytes())
    reader = _MatlabReader(path, ">" if bytes(data[126:128]) == b"MI" else "<")
    if len(data) < HEADER_BYTES + 8:
        raise reader.damaged(f"{len(data)} bytes; its header alone has {HEADER_BYTES}")
    reader.top_level(data)
    return RawFile(path=path, format=FORMAT.name, variables=reader.variables)


@dataclass(frozen=True, kw_only=True)
class _Element:
    """A tag with its data: MATLAB's type number, and where the data lie."""

    kind: int
    start: int
    stop: int


class _MatlabReader:
    """Walks the elements of one file into `variables`; allocates no more than the bytes that are there."""

    def __init__(self, path: Path, order: str) -> None:
        self.path = path
        self.order = order
        self.claimed = 0
        self.elements = 0
        self.variables: dict[str, Value] = {}

    def damaged(self, what: str) -> DataError:
        return DataError(f"{self.path}: truncated or damaged MATLAB v5 file ({what}). Copy it again.")

    def top_level(self, data: memoryview) -> None:
        for element in self._elements(data, HEADER_BYTES, len(data)):
            if element.kind == MI_COMPRESSED:
                inner = self._expanded(data[element.start : element.stop])
                for one in self._elements(inner, 0, len(inner)):
                    self._array(inner, one, None, 0)
            else:
                self._array(data, element, None, 0)

    def _elements(self, data: memoryview, start: int, stop: int) -> Iterator[_Element]:
        """Elements between `start` and `stop`; each must end before `stop`."""
        at = start
        while at + 8 <= stop:
            self.elements += 1
            if self.elements > MAX_ELEMENTS:
                raise self.damaged(f"more than {MAX_ELEMENTS} elements")
            kind, count = struct.unpack_from(self.order + "II", data, at)
            if kind >> 16:  # small element: byte count and up to 4 bytes of data share the tag
                yield _Element(kind=kind & 0xFFFF, start=at + 4, stop=at + 4 + min(kind >> 16, 4))
                at += 8
                continue
            if at + 8 + count > stop:
                raise self.damaged(f"an element of {count} bytes at byte {at} of {stop}")
            yield _Element(kind=kind, start=at + 8, stop=at + 8 + count)
            at += 8 + count + (0 if kind == MI_COMPRESSED else -count % 8)

    def _expanded(self, stream: memoryview) -> memoryview:
        """The element inside a zlib stream, its claimed size checked before it is expanded."""
        try:
            head = zlib.decompressobj().decompress(stream, 8)
            if len(head) < 8:
                raise self.damaged("a compressed element without a tag")
            self.claimed += 8 + int(struct.unpack(self.order + "II", head)[1])
            check_claim(self.path, self.claimed, "its contents")
            return memoryview(zlib.decompressobj().decompress(stream, largest_claim(self.path)))
        except zlib.error as error:
            raise self.damaged(f"compressed data, {error}") from None

    def _array(self, data: memoryview, element: _Element, name: str | None, depth: int) -> None:
        """Read one array under `name`, or under its own name at the top level."""
        if element.kind != MI_MATRIX:
            raise self.damaged(f"element type {element.kind} at byte {element.start} where an array should be")
        if depth > MAX_DEPTH:
            raise self.damaged(f"arrays nested deeper than {MAX_DEPTH}")
        parts = self._elements(data, element.start, element.stop)
        flags = self._integers(data, next(parts, None), "u4")
        kind = flags[0] & 0xFF if flags else 0
        if kind not in (CELL, STRUCT, OBJECT, CHAR, *NUMERIC_CLASSES):
            return
        shape = self._integers(data, next(parts, None), "i4")
        own_name = self._text(data, next(parts, None))
        name = own_name if name is None else name
        total = math.prod(shape)
        if any(n < 0 for n in shape) or total > element.stop - element.start:
            claim = " x ".join(map(str, shape))
            raise self.damaged(f"{name!r} claims {claim} in {element.stop - element.start} bytes")
        if kind == CHAR:
            self.variables[name] = self._text(data, next(parts, None)).strip()
        elif kind in NUMERIC_CLASSES:
            if not flags[0] & COMPLEX_FLAG:
                self.variables[name] = self._numbers(data, next(parts, None), shape, name)
        elif kind == CELL:
            self._members(data, parts, total, [""], name, depth)
        else:
            if kind == OBJECT:
                next(parts, None)  # the class's name
            self._members(data, parts, total, self._fields(data, parts), name, depth)

    def _fields(self, data: memoryview, parts: Iterator[_Element]) -> list[str]:
        """Names of a struct's fields: texts of one length, padded with zeros."""
        length = self._integers(data, next(parts, None), "i4")
        names = next(parts, None)
        if names is None or not length or length[0] <= 0:
            raise self.damaged("a struct without field names")
        raw = bytes(data[names.start : names.stop])
        if len(raw) // length[0] > MAX_ELEMENTS:
            raise self.damaged(f"more than {MAX_ELEMENTS} field names")
        cut = [raw[i : i + length[0]] for i in range(0, len(raw) - length[0] + 1, length[0])]
        return ["." + text.split(b"\0", 1)[0].decode("latin-1") for text in cut]

    def _members(
        self, data: memoryview, parts: Iterator[_Element], total: int, fields: list[str], name: str, depth: int
    ) -> None:
        """Elements of a cell or struct array, each with its fields in turn."""
        for i in range(total if fields else 0):
            index = "" if total == 1 else f"({i + 1})"
            for field in fields:
                member = next(parts, None)
                if member is None:
                    raise self.damaged(f"{name}{index}{field} is missing")
                self._array(data, member, f"{name}{index}{field}", depth + 1)

    def _integers(self, data: memoryview, element: _Element | None, kind: str) -> list[int]:
        """A few integers: flags, dimensions, a length."""
        if element is None or element.stop - element.start > 256:
            return []
        raw = data[element.start : element.stop]
        return [int(n) for n in np.frombuffer(raw[: len(raw) // 4 * 4], self.order + kind)]

    def _text(self, data: memoryview, element: _Element | None) -> str:
        """A text in whichever encoding its type says; overlong ones are cut."""
        if element is None:
            return ""
        coding = TEXTS.get(element.kind, "latin-1")
        ends = {"<": "-le", ">": "-be"}[self.order] if coding in ("utf-16", "utf-32") else ""
        raw = bytes(data[element.start : min(element.stop, element.start + MAX_TEXT_BYTES)])
        return raw.decode(coding + ends, "replace").replace("\0", "")

    def _numbers(self, data: memoryview, element: _Element | None, shape: list[int], name: str) -> NDArray[Any]:
        """The real part as stored (MATLAB stores whole numbers in fewer bytes), column-major."""
        if math.prod(shape) == 0 or element is None:
            return np.zeros(0)
        if element.kind not in NUMBERS:
            raise self.damaged(f"{name!r} has data of type {element.kind}")
        kind = np.dtype(self.order + NUMBERS[element.kind])
        if math.prod(shape) * kind.itemsize != element.stop - element.start:
            claim = " x ".join(map(str, shape))
            raise self.damaged(f"{name!r} claims {claim} numbers in {element.stop - element.start} bytes")
        values = np.frombuffer(data, kind, math.prod(shape), element.start)
        return values.reshape(shape, order="F")


FORMAT = FileFormat(
    name="MATLAB v5",
    description="MATLAB v5",
    matches=lambda head: head.startswith(TITLE) or head[124:HEADER_BYTES] in VERSION_AND_ENDIAN,
    load=load_matlab_v5,
)
