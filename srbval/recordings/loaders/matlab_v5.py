"""MATLAB v5 to v7 files, read with every size checked before it is used.

Layout: MATLAB "MAT-File Format", MathWorks, chapter 1. An element is a tag (type, byte count) and its
data, padded to 8 bytes; an array (type 14) holds elements again: flags, dimensions, name, then data or
further arrays; type 15 is a zlib stream of one element. scipy.io.loadmat reads the same files, but a few
flipped bits make it allocate gigabytes or end the process (bus error, scipy 1.17); it serves as the
reference in the tests.

It needs no process with limits, unlike the HDF5 library: elements never overlap, at most `MAX_ELEMENTS` tags and names
of fields are read, a compressed element is expanded to its claim and no more, and the sum of these claims, of names
and of texts stays below `largest_claim`. Arrays are views.
"""

import itertools
import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import FileFormat, RawFile, Value, check_claim

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
MAX_NAME_BYTES = 255  # MATLAB's own limit is 63
MAX_TEXT_BYTES = 65536
MAX_DIMENSIONS = 32


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
    reader.top_level(data[HEADER_BYTES:])
    return RawFile(path=path, format=FORMAT.name, variables=reader.variables)


class _Element(NamedTuple):
    """A tag with its data: MATLAB's type number, and the bytes."""

    kind: int
    data: memoryview


_MISSING = _Element(0, memoryview(b""))


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

    def _count(self, more: int) -> None:
        self.elements += more
        if self.elements > MAX_ELEMENTS:
            raise self.damaged(f"more than {MAX_ELEMENTS} elements")

    def _claim(self, more: int) -> None:
        self.claimed += more
        check_claim(self.path, self.claimed, "its contents")

    def top_level(self, data: memoryview) -> None:
        for element in self._elements(data):
            compressed = element.kind == MI_COMPRESSED
            for array in self._elements(self._expanded(element.data)) if compressed else (element,):
                self._array(array, None, 0)

    def _elements(self, data: memoryview) -> Iterator[_Element]:
        """Elements of `data`; each must end before its end."""
        at = 0
        while at + 8 <= len(data):
            self._count(1)
            kind, count = struct.unpack_from(self.order + "II", data, at)
            if kind >> 16:  # small element: byte count and up to 4 bytes of data share the tag
                yield _Element(kind & 0xFFFF, data[at + 4 : at + 4 + min(kind >> 16, 4)])
                at += 8
                continue
            if at + 8 + count > len(data):
                raise self.damaged(f"an element of {count} bytes at byte {at} of {len(data)}")
            yield _Element(kind, data[at + 8 : at + 8 + count])
            at += 8 + count + (0 if kind == MI_COMPRESSED else -count % 8)

    def _expanded(self, stream: memoryview) -> memoryview:
        """The element inside a zlib stream, its claimed size checked before it is expanded."""
        try:
            head = zlib.decompressobj().decompress(stream, 8)
            if len(head) < 8:
                raise self.damaged("a compressed element without a tag")
            whole = 8 + int(struct.unpack(self.order + "II", head)[1])
            self._claim(whole)
            expander = zlib.decompressobj()
            data = expander.decompress(stream, whole + 8)  # room for padding, so that the end and its checksum are seen
            if not expander.eof:
                raise self.damaged(f"a compressed element that does not end after the {whole} bytes it claims")
            return memoryview(data)
        except zlib.error as error:
            raise self.damaged(f"compressed data, {error}") from None

    def _array(self, element: _Element, name: str | None, depth: int) -> None:
        """Read one array under `name`, or under its own name at the top level."""
        if element.kind != MI_MATRIX:
            raise self.damaged(f"element type {element.kind} where an array should be")
        if depth > MAX_DEPTH:
            raise self.damaged(f"arrays nested deeper than {MAX_DEPTH}")
        parts = itertools.chain(self._elements(element.data), itertools.repeat(_MISSING))
        flags = self._integers(next(parts), "u4")
        kind = flags[0] & 0xFF if flags else 0
        if kind not in (CELL, STRUCT, OBJECT, CHAR, *NUMERIC_CLASSES):
            return
        shape = self._integers(next(parts), "i4")
        own_name = self._text(next(parts))
        name = own_name[:MAX_NAME_BYTES] if name is None else name
        self._claim(len(name))
        total = math.prod(shape)
        if len(shape) > MAX_DIMENSIONS or any(n < 0 for n in shape) or total > len(element.data):
            raise self.damaged(f"{name!r} claims {' x '.join(map(str, shape))} in {len(element.data)} bytes")
        if kind == CHAR:
            self.variables[name] = self._text(next(parts)).strip()
        elif kind in NUMERIC_CLASSES:
            if not flags[0] & COMPLEX_FLAG:
                self.variables[name] = self._numbers(next(parts), shape, name)
        else:
            if kind == OBJECT:
                next(parts)  # the class's name
            fields = [""] if kind == CELL else self._fields(parts)
            for i in range(total if fields else 0):
                index = "" if total == 1 else f"({i + 1})"
                for field in fields:
                    member = next(parts)
                    if member is _MISSING:
                        raise self.damaged(f"{name}{index}{field} is missing")
                    self._array(member, f"{name}{index}{field}", depth + 1)

    def _fields(self, parts: Iterator[_Element]) -> list[str]:
        """Names of a struct's fields: texts of one length, padded with zeros."""
        length, raw = self._integers(next(parts), "i4"), bytes(next(parts).data)
        if not length or length[0] <= 0:
            raise self.damaged("a struct without field names")
        self._count(len(raw) // length[0])
        cut = [raw[i : i + length[0]] for i in range(0, len(raw) - length[0] + 1, length[0])]
        return ["." + text.split(b"\0", 1)[0][:MAX_NAME_BYTES].decode("latin-1") for text in cut]

    def _integers(self, element: _Element, kind: str) -> list[int]:
        """A few integers: flags, dimensions, a length."""
        raw = element.data if len(element.data) <= 256 else b""
        return [int(n) for n in np.frombuffer(raw[: len(raw) // 4 * 4], self.order + kind)]

    def _text(self, element: _Element) -> str:
        """A text in whichever encoding its type says; overlong ones are cut."""
        coding = TEXTS.get(element.kind, "latin-1")
        ends = {"<": "-le", ">": "-be"}[self.order] if coding in ("utf-16", "utf-32") else ""
        self._claim(4 * min(len(element.data), MAX_TEXT_BYTES))  # a character takes up to 4 bytes
        return bytes(element.data[:MAX_TEXT_BYTES]).decode(coding + ends, "replace").replace("\0", "")

    def _numbers(self, element: _Element, shape: list[int], name: str) -> NDArray[Any]:
        """The real part as stored (MATLAB stores whole numbers in fewer bytes), column-major."""
        if math.prod(shape) == 0 or element is _MISSING:
            return np.zeros(0)
        if element.kind not in NUMBERS:
            raise self.damaged(f"{name!r} has data of type {element.kind}")
        kind, held = np.dtype(self.order + NUMBERS[element.kind]), len(element.data)
        if math.prod(shape) * kind.itemsize != held:
            raise self.damaged(f"{name!r} claims {' x '.join(map(str, shape))} numbers in {held} bytes")
        return np.frombuffer(element.data, kind).reshape(shape, order="F")


FORMAT = FileFormat(
    name="MATLAB v5",
    description="MATLAB v5",
    matches=lambda head: head.startswith(TITLE) or head[124:HEADER_BYTES] in VERSION_AND_ENDIAN,
    load=load_matlab_v5,
)
