"""Damage to HDF5 files that knows their structure, and makes checksums right again, so that the library believes it.

Layout: HDF5 File Format Specification 3.0. Structures are found by their signatures, the messages of object headers
by walking through them from the addresses that the library gives.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numba
import numpy as np

from . import files

SIGNATURES = (
    b"\x89HDF", b"GCOL", b"HEAP", b"SNOD", b"TREE", b"OHDR", b"OCHK", b"FRHP", b"FHDB", b"FHIB", b"BTHD", b"BTIN",
    b"BTLF", b"FAHD", b"FADB", b"EAHD", b"EAIB", b"EASB", b"EADB", b"SMTB", b"SMLI",
)  # fmt: skip
OLD = (b"GCOL", b"HEAP", b"SNOD", b"TREE", b"FHDB")  # without a checksum at the end
LONGEST = 4096  # bytes of a structure with a checksum
NUMBERS = {1: "<B", 2: "<H", 4: "<I", 8: "<Q"}


@dataclass(frozen=True)
class Region:
    """Bytes `start` to `end` of one kind; at `place` a checksum over `checked` bytes from `base`, 0: none.

    One that lies among those bytes counts as zeros.
    """

    kind: str
    start: int
    end: int
    base: int = 0
    checked: int = 0
    place: int = 0


@dataclass(frozen=True)
class Whole:
    """A file and what is known of it; `addresses` are where structures begin."""

    data: bytes
    regions: dict[str, list[Region]]
    addresses: list[int]


@numba.njit(cache=False)
def lookup3(data: np.ndarray, length: int) -> int:
    """Jenkins's hash of the first `length` bytes, the checksum of HDF5's structures."""
    mask = np.uint64(0xFFFFFFFF)
    word = np.uint64((0xDEADBEEF + length) & 0xFFFFFFFF)
    s = np.array([word, word, word], dtype=np.uint64)
    at = 0
    while length - at > 12:
        for i in range(3):
            for k in range(4):
                s[i] += np.uint64(data[at + 4 * i + k]) << np.uint64(8 * k)
            s[i] &= mask
        at += 12
        for minus, plus, turn in ((2, 1, 4), (0, 2, 6), (1, 0, 8), (2, 1, 16), (0, 2, 19), (1, 0, 4)):
            first = (minus + 1) % 3
            s[first] = (s[first] - s[minus]) & mask
            s[first] ^= ((s[minus] << np.uint64(turn)) | (s[minus] >> np.uint64(32 - turn))) & mask
            s[minus] = (s[minus] + s[plus]) & mask
    if length == at:
        return s[2]
    for k in range(length - at):
        s[k // 4] += np.uint64(data[at + k]) << np.uint64(8 * (k % 4))
    for i in range(3):
        s[i] &= mask
    for to, by, turn in ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24)):
        s[to] ^= s[by]
        s[to] = (s[to] - (((s[by] << np.uint64(turn)) | (s[by] >> np.uint64(32 - turn))) & mask)) & mask
    return s[2]


@numba.njit(cache=False)
def checked_length(data: np.ndarray, most: int) -> int:
    """How many bytes from the beginning are followed by their checksum; 0 where none are."""
    for length in range(8, most - 4):
        stored = np.uint64(0)
        for k in range(4):
            stored |= np.uint64(data[length + k]) << np.uint64(8 * k)
        if lookup3(data, length) == stored:
            return length
    return 0


class StructureDamage:
    """Damages one structure of one of the files that `make_files` writes."""

    def __init__(self, folder: Path) -> None:
        self.wholes = [known(path) for path in make_files(folder)]
        self.kinds = sorted({kind for whole in self.wholes for kind in whole.regions})

    def damaged(self, rng: np.random.Generator, i: int) -> bytes:
        """The `i`-th damaged file: each kind of structure has its turn."""
        kind = self.kinds[i % len(self.kinds)]
        having = [whole for whole in self.wholes if kind in whole.regions]
        whole = having[int(rng.integers(len(having)))]
        data = bytearray(whole.data)
        changed = set()
        for _ in range(int(rng.integers(1, 4))):
            region = whole.regions[kind][int(rng.integers(len(whole.regions[kind])))]
            _change(rng, data, region, whole.addresses)
            changed.add(region)
        for region in changed if rng.random() < 0.9 else ():
            _check(data, region)
        return bytes(data)


def _change(rng: np.random.Generator, data: bytearray, region: Region, addresses: list[int]) -> None:
    """One number of a structure becomes another; most of what matters is at its beginning."""
    width = int(rng.choice((1, 1, 2, 4, 8)))
    length = max(region.end - region.start - width, 1)
    at = region.start + int(rng.integers(min(length, int(rng.choice((16, 48, 10**6))))))
    if at + width > len(data):
        return
    most = 256**width - 1
    old = int.from_bytes(data[at : at + width], "little")
    new = (
        0, 1, most, most // 2, most // 2 + 1, old + 1, old - 1, 2 * old, old ^ (1 << int(rng.integers(8 * width))),
        len(data), region.start, addresses[int(rng.integers(len(addresses)))], int(rng.integers(64)),
        int.from_bytes(rng.bytes(width), "little"),
    )[int(rng.integers(14))]  # fmt: skip
    struct.pack_into(NUMBERS[width], data, at, new & most)


def _check(data: bytearray, region: Region) -> None:
    """Make the checksum right again."""
    if region.checked:
        if region.place < region.base + region.checked:
            struct.pack_into("<I", data, region.place, 0)
        part = np.frombuffer(bytes(data[region.base : region.base + region.checked]), np.uint8)
        struct.pack_into("<I", data, region.place, lookup3(part, len(part)))


def _heap_block(data: bytes, at: int) -> tuple[int, int]:
    """Size of a block of a fractal heap and the place of its checksum, behind an offset of a few bytes."""
    for size in (512, 1024, 2048, 4096):
        for place in range(at + 14, at + 22):
            part = bytearray(data[at : at + size])
            part[place - at : place - at + 4] = bytes(4)
            if len(part) == size and data[place : place + 4] == struct.pack(
                "<I", lookup3(np.frombuffer(bytes(part), np.uint8), size)
            ):
                return size, place
    return 0, 0


def known(path: Path) -> Whole:
    """Structures of a file: those with signatures, and the messages of its object headers by their types."""
    data = path.read_bytes()
    codes = np.frombuffer(data + bytes(16), np.uint8)
    regions: dict[str, list[Region]] = {}
    for signature in SIGNATURES:
        at = data.find(signature)
        while at >= 0:
            checked = checked_length(codes[at:], min(LONGEST, len(data) - at)) if signature not in OLD else 0
            place = at + checked
            if signature == b"FHDB":
                checked, place = _heap_block(data, at)
            kind = signature.decode("latin-1")
            region = Region(kind, at + 4, min(at + (checked or 256), len(data)), at, checked, place)
            regions.setdefault(kind, []).append(region)
            at = data.find(signature, at + 4)
    with h5py.File(path) as file:
        base = file.userblock_size
        headers = {base + h5py.h5o.get_info(file.id).addr}
        file.visititems(lambda _, item: headers.add(base + h5py.h5o.get_info(item.id).addr))
    for header in headers:
        found = regions.get("OHDR", []) if data.startswith(b"OHDR", header) else None
        checked = next((r.checked for r in found or () if r.base == header), 0)
        for kind, start, end in messages(data, header):
            regions.setdefault(f"message {kind}", []).append(
                Region(f"message {kind}", start, end, header, checked, header + checked)
            )
    addresses = [r.base for found in regions.values() for r in found] or [0]
    return Whole(data, regions, addresses)


def messages(data: bytes, header: int) -> Iterator[tuple[int, int, int]]:
    """Type, beginning (its type and size among it) and end of each message of an object header's first block."""
    if data.startswith(b"OHDR", header):
        flags = data[header + 5]
        at = header + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        end = at + width + int.from_bytes(data[at : at + width], "little")
        at, before, kind_bytes = at + width, 6 if flags & 4 else 4, 1
    else:
        end = header + 16 + int.from_bytes(data[header + 8 : header + 12], "little")
        at, before, kind_bytes = header + 16, 8, 2
    while at + before <= min(end, len(data)):
        kind = int.from_bytes(data[at : at + kind_bytes], "little")
        size = int.from_bytes(data[at + kind_bytes : at + kind_bytes + 2], "little")
        yield kind, at, min(at + before + size, len(data))
        at += before + size


def make_files(folder: Path) -> list[Path]:
    """Small files that hold every structure, in the format of HDF5 1.6 and in the newest."""
    made = []
    for i, version in enumerate(("earliest", "latest")):
        for part in PARTS:
            made.append(folder / f"{part.__name__}{i}.h5")
            with h5py.File(made[-1], "w", libver=version) as file:
                file.attrs["fs_hz"] = 1000.0
                part(file)
    return made


def _texts(file: h5py.File) -> None:
    file["x"] = files.vibration(300)
    file["name"], file["short"] = "hello", np.bytes_(b"fixed")
    file["x"].attrs.update({"units": "m/s2", "note": "of variable length", "MATLAB_class": np.bytes_(b"double")})
    file.attrs.update({"srbval_note": "text", "rpm": 1000.0})
    file["names"] = ["one", "two", "three"]


def _types(file: h5py.File) -> None:
    file["x"] = files.vibration(300).astype("f4")
    file["fields"] = np.zeros(5, [("a", "f8"), ("b", "i2", (3,)), ("c", "S4")])
    file["switch"], file["whole"], file["pair"] = True, np.arange(300, dtype=">i2"), np.ones(4) * 1j
    file.create_dataset("enum", data=np.arange(4), dtype=h5py.enum_dtype({"A": 0, "B": 1, "C": 3, "D": 2}))
    lists = file.create_dataset("lists", 3, h5py.vlen_dtype(np.dtype("i4")))
    lists[0], lists[1] = np.arange(3), np.arange(5)
    file.create_dataset("sub", (4,), np.dtype("(2,3)f8"))[:] = np.ones((4, 2, 3))
    file["kind"] = np.dtype("f8")
    for name, value in (("array", np.arange(5.0)), ("fields", np.zeros(2, "f8,i4")), ("lists", ["a", "bb"])):
        file["x"].attrs[name] = value
        file.attrs[name] = value
    file.attrs["reference"] = file["x"].ref


def _references(file: h5py.File) -> None:
    file.attrs["MATLAB_class"] = np.bytes_(b"struct")
    held = file.create_group("#refs#")
    held["a"], held["b"] = files.vibration(300)[None], np.array([[104], [105]], np.uint16)
    held["b"].attrs["MATLAB_class"] = np.bytes_(b"char")
    cell = file.create_dataset("cell", (1, 2), dtype=h5py.ref_dtype)
    cell[0, 0], cell[0, 1] = held["a"].ref, held["b"].ref
    cell.attrs["MATLAB_class"] = np.bytes_(b"cell")
    file["region"] = held["a"].regionref[0, :10]
    file["soft"], file["out"] = h5py.SoftLink("/cell"), h5py.ExternalLink("none.h5", "/x")


def _chunks(file: h5py.File) -> None:
    """Every index of chunks: B-tree, single chunk, implicit, fixed array, extensible array, B-tree of version 2."""
    values = files.vibration(1200)
    packed = {"compression": "gzip", "shuffle": True, "fletcher32": True}
    file.create_dataset("x", data=values, chunks=(300,), **packed)
    file.create_dataset("one", data=values, chunks=(1200,), compression="gzip")
    file.create_dataset("grows", data=values, chunks=(20,), maxshape=(None,))
    file.create_dataset("both", data=values.reshape(40, 30), chunks=(10, 10), maxshape=(None, None), compression="lzf")
    file.create_dataset("scaled", data=np.arange(600), chunks=(100,), scaleoffset=0)
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((100,))
    settings.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    space = h5py.h5s.create_simple((1200,))
    h5py.h5d.create(file.id, b"early", h5py.h5t.IEEE_F64LE, space, settings)
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_layout(h5py.h5d.COMPACT)
    h5py.h5d.create(file.id, b"compact", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((20,)), settings)


def _many(file: h5py.File) -> None:
    """Heaps and trees of links and attributes."""
    file["x"] = files.vibration(300)
    group = file.create_group("many", track_order=True)
    for i in range(40):
        group[f"link{i}"] = h5py.SoftLink("/x") if i % 2 else file["x"]
        file["x"].attrs[f"attribute{i}"] = i
        file.attrs[f"number{i}"] = float(i) if i % 3 else f"text {i}"
    file["x"].attrs["long"] = np.zeros(3000)


PARTS: tuple[Callable[[h5py.File], None], ...] = (_texts, _types, _references, _chunks, _many)
