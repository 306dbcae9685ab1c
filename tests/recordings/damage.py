"""Damaged and hostile files without end, seeded: every format times every damage, and files that claim too much."""

import contextlib
import hashlib
import itertools
import os
import pickle
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numba
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.storage.hdf5_files import END, MARK
from tests.recordings.synthetic_record import write_synthetic_record

from . import files, formats

HOSTILE = (
    "", " ", "\x00", "\x1b[2J\x1b]0;owned\x07", "a\nb\r\nc", "../../../../etc/passwd", "$(touch owned)", "'; rm -rf /",
    "%s%s%s%n", "{0.__class__}", "\u202e\ufeff\ud7ff", "é" * 5000, "A" * 70000, "nan", "1e999", "-0", "__class__",
)  # fmt: skip
DTYPES = ("i1", "u2", "i8", "f4", "c16", "?", "U3", ">f8", "f8")
NPY_TYPES = ("'<f8'", "'|O'", "'<U9'", "'<M8[ns]'", "'f16'", "8", "''", "[('a', '|O')]", "('<f8', (10**9,))", "[[[]]]")
NPY_SHAPES = (
    "(4096,)", "(8,)", "()", "(-1,)", "(-8, -512)", "(4096.0,)", "(True,)", f"({2**61 + 4096},)", f"({2**32}, {2**32})",
    f"({'9' * 4999},)", f"({'1,' * 70})", f"(0, {2**63})",
    "(" * 5000, "1+" * 4900, "a" + ".b" * 4900, "{" * 150 + "}" * 150, "\xff" * 9999, "\0" * 64,
)  # fmt: skip
HDF5_CHECKED = re.compile(b"OHDR|OCHK|FRHP|FHIB|BTHD|BTIN|BTLF|FAHD|FADB|EAHD|EAIB|EASB|EADB|SMTB|SMLI|\x89HDF")
MATLAB_HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
Rng = np.random.Generator


class Trap:
    """Makes a folder when it is unpickled: that must never happen."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.folder),)


class Damage:
    """Writes the i-th damaged file to a path; a seed of its own for each."""

    def __init__(self, folder: Path, trap: Path, seed: int = 20260101) -> None:
        self.seed, self.trap = seed, trap
        self.whole = dict(_whole_files(folder))
        damages = (flipped, overwritten, cut, numbers, believed)
        claims = (values, text, npy_header, matlab_claim, hdf5_types, self._pickle)
        self.cells = [*itertools.product(self.whole, damages), *((claim.__name__, claim) for claim in claims * 4)]

    def write(self, i: int, path: Path) -> tuple[str, str]:
        """Write file `i`; says the format and the damage."""
        rng = np.random.default_rng((self.seed, i))
        name, damage = self.cells[i % len(self.cells)]
        made = damage(rng, self.whole[name]) if name in self.whole else damage(rng, path)
        if made is not None:
            path.write_bytes(made)
        return name, damage.__name__

    def _pickle(self, rng: Rng, path: Path) -> bytes | None:
        if rng.random() < 0.5:
            return pickle.dumps(Trap(self.trap), protocol=int(rng.integers(0, 6)))
        box = np.empty(int(rng.integers(1, 4)), dtype=object)
        box[:] = Trap(self.trap)
        with path.open("wb") as stream:
            np.save(stream, box, allow_pickle=True)
        return None


def flipped(rng: Rng, whole: bytes) -> bytes:
    data = bytearray(whole)
    for position in rng.integers(0, min(len(data), int(rng.choice((400, 2000, 10**9)))), int(rng.integers(1, 8))):
        data[position] ^= 1 << int(rng.integers(8))
    return bytes(data)


def overwritten(rng: Rng, whole: bytes) -> bytes:
    at, length = int(rng.integers(len(whole))), int(rng.integers(1, 200))
    return whole[:at] + (rng.bytes(length) if rng.random() < 0.5 else bytes(length)) + whole[at + length :]


def cut(rng: Rng, whole: bytes) -> bytes:
    return whole[: int(rng.integers(len(whole)))] if rng.random() < 0.95 else b""


def numbers(rng: Rng, whole: bytes, changes: int = 3) -> bytes:
    """Sizes, counts, types and addresses become others; most of what matters is at the beginning."""
    data = bytearray(whole)
    for _ in range(changes):
        width = int(rng.choice((1, 2, 4, 8)))
        at = int(rng.integers(max(1, min(len(data) - width, int(rng.choice((64, 400, 4000, 10**6)))))))
        most, old = 256**width - 1, int.from_bytes(data[at : at + width], "little")
        new = (
            0, 1, most, most // 2, most // 2 + 1, old + 1, old - 1, 2 * old, old ^ (1 << int(rng.integers(8 * width))),
            len(data), at, 14, 15, int(rng.integers(64)), int.from_bytes(rng.bytes(width), "little"),
        )[int(rng.integers(15))]  # fmt: skip
        data[at : at + width] = (new & most).to_bytes(width, "little")
    return bytes(data)


def believed(rng: Rng, whole: bytes) -> bytes:
    """Numbers changed within what is compressed or has a checksum, and that made right again: libraries believe it."""
    if whole.startswith(b"MATLAB 5.0"):
        made, at = [whole[:128]], 128
        while at + 8 <= len(whole):
            kind, count = struct.unpack_from("<II", whole, at)
            body = zlib.decompress(whole[at + 8 : at + 8 + count]) if kind == 15 else whole[at : at + 8 + count]
            packed = zlib.compress(numbers(rng, body, int(rng.integers(3))))
            made.append(struct.pack("<II", 15, len(packed)) + packed)
            at += 8 + count
        return b"".join(made)
    whole, *end = END.split(whole)[0], *END.findall(whole)  # of a file of srbval
    codes, data = np.frombuffer(whole + bytes(16), np.uint8), bytearray(whole)
    found = [(m.start(), checked_length(codes[m.start() :], 4096)) for m in HDF5_CHECKED.finditer(whole)]
    checked = [(start, length) for start, length in found if length]
    if not checked:
        return numbers(rng, whole, 8)
    for start, length in (checked[i] for i in rng.integers(0, len(checked), 2)):
        data[start + 4 : start + length] = numbers(rng, bytes(data[start + 4 : start + length]), 2)
        struct.pack_into("<I", data, start + length, lookup3(np.frombuffer(bytes(data[start:]), np.uint8), length))
    sealed = bytes(data) + MARK % 0
    return sealed + hashlib.sha256(sealed).hexdigest().encode() + b"\n" if end else bytes(data)


def values(rng: Rng, path: Path) -> None:
    """Values, types, shapes or texts that are not what they should be, in a file that is whole."""
    spoilt, hostile = _spoilt(rng, files.vibration()), str(rng.choice(HOSTILE))
    choice = rng.integers(5)
    if choice == 0:
        signals = files.rig_signals()
        boxed: object = signals["Signal_2"]
        for _ in range(int(rng.choice((0, 0, 1, 60)))):
            boxed = files.nested(boxed)
        signals["Signal_2"] = boxed
        signals["Signal_3"]["y_values"]["values"] = files.nested(spoilt) if rng.random() < 0.5 else spoilt
        signals["Signal_3"]["y_values"]["quantity"]["label"] = hostile
        signals["Signal_3"]["x_values"]["increment"] = float(rng.choice((0.0, -1.0, np.nan, np.inf, 1e-300, 1e300)))
        savemat(path, signals, do_compression=bool(rng.random() < 0.5))
    elif choice == 1:
        files.excerpt(path, acc_m_s2=spoilt, condition=hostile, rpm=_spoilt(rng, np.ones(128)))
    elif choice == 2:
        savemat(path, {"X105_DE_time": spoilt, "X105RPM": _spoilt(rng, np.ones((1, 1)) * 1797)})
    elif choice == 3:
        with path.open("wb") as stream:
            np.save(stream, spoilt, allow_pickle=False)
    else:
        with h5py.File(path, "w") as file:
            file["x"] = spoilt.astype("S8") if spoilt.dtype.kind == "U" else spoilt
            file.attrs["srbval_kind"] = hostile.replace("\x00", "")[:30000] if rng.random() < 0.5 else "stand-in"
            file.attrs["fs_hz"] = float(rng.choice((0.0, -1.0, np.nan, np.inf, 1000.0)))
            file["link"] = h5py.ExternalLink("/etc/passwd", "/x") if rng.random() < 0.5 else h5py.SoftLink("/link")


def text(rng: Rng, _: Path) -> bytes:
    rows = [f"{x:.4f}" for x in files.vibration(400)]
    for position in rng.integers(0, len(rows), 3):
        rows[position] = str(rng.choice(HOSTILE))
    head = f"# fs_hz = {rng.choice(HOSTILE)}\n" if rng.random() < 0.5 else ""
    return (head + str(rng.choice(("\n", ",", ";", "\t"))).join(rows)).encode("utf-8", "replace")


def hdf5_types(rng: Rng, path: Path) -> None:
    """Data sets and attributes of every type, of sizes from nothing to far more than a file should hold."""
    h5t, size = h5py.h5t, int(rng.choice((0, 1, 3, 300, 70_000)))
    kinds = [
        h5t.IEEE_F64BE, h5t.IEEE_F16LE, h5t.STD_REF_OBJ, h5t.STD_REF_DSETREG, h5t.STD_B32LE, h5t.UNIX_D32LE,
        h5t.array_create(h5t.IEEE_F64LE, (3, 50)), h5t.vlen_create(h5t.vlen_create(h5t.STD_I8LE)),
        h5t.create(h5t.OPAQUE, 9), h5t.py_create(np.dtype("g")), h5t.py_create(h5py.string_dtype("ascii", 5000)),
        h5t.py_create(np.dtype([("a", "f8"), ("b", "i4", (2, 2)), ("c", "S9")])),
    ]  # fmt: skip
    with h5py.File(path, "w", libver=str(rng.choice(("earliest", "latest")))) as file:
        for name in (b"x", b"MATLAB_class", b"fs_hz", b"y"):
            kind = kinds[int(rng.integers(len(kinds)))]
            space = h5py.h5s.create_simple((size,)) if rng.random() < 0.7 else h5py.h5s.create(h5py.h5s.SCALAR)
            settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            settings.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY if rng.random() < 0.7 else h5py.h5d.ALLOC_TIME_LATE)
            h5py.h5d.create(file.id, name, kind, space, settings)
            if size * kind.get_size() < 60_000:
                h5py.h5a.create(file.id, name, kind, space)


def npy_header(rng: Rng, _: Path) -> bytes:
    """A NumPy header of pieces that are wrong for themselves or together."""
    kind, shape = (str(rng.choice(pieces)) for pieces in (NPY_TYPES, NPY_SHAPES))
    header = f"{{'descr': {kind}, 'fortran_order': {rng.choice(('False', 'True', '0'))}, 'shape': {shape}, }}"
    version = int(rng.choice((1, 1, 1, 2, 3, 9)))
    length = len(header) if rng.random() < 0.8 else int(rng.choice((0, 1, 65535, len(header) - 1)))
    head = b"\x93NUMPY" + bytes((version, 0)) + struct.pack("<H" if version == 1 else "<I", length)
    return head + header.encode() + bytes(int(rng.choice((0, 64, 8 * 4096))))


def matlab_claim(rng: Rng, _: Path) -> bytes:
    """Elements that claim little and hold much, or the other way round, once or very often."""
    held, claimed, count = (int(10 ** rng.uniform(0, most)) for most in (7, 9, 4))
    kind, shape = int(rng.choice((1, 2, 4, 6))), rng.choice((held, claimed, 2**31 - 1, -1), 2)
    body = struct.pack("<IIIIIIii", 6, 8, kind, 0, 5, 8, *(int(n) for n in shape))
    body += struct.pack("<II", 1, 1) + b"x".ljust(8) + struct.pack("<II", 2, held) + bytes(held + -held % 8)
    body = struct.pack("<II", 14, len(body) if rng.random() < 0.5 else claimed) + body
    packed = zlib.compress(body)
    return MATLAB_HEADER + (struct.pack("<II", 15, len(packed)) + packed) * count


def _spoilt(rng: Rng, whole: np.ndarray) -> np.ndarray:
    """Values of a wrong type, with NaN or infinity, of length zero, or of an odd shape."""
    choice = rng.integers(5)
    if choice == 0:
        with np.errstate(all="ignore"):
            return whole.astype(str(rng.choice(DTYPES)))
    if choice == 1:
        spoilt = whole.astype(float).copy()
        spoilt.flat[int(rng.integers(spoilt.size))] = rng.choice((np.nan, np.inf, -np.inf, 1e308))
        return spoilt
    odd = whole.reshape(1, -1, *((1,) * int(rng.integers(1, 5))))
    return (whole[:0], odd, np.zeros_like(whole, dtype=float))[choice - 2]


def _whole_files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for kind in formats.WRITERS:
        with contextlib.suppress(pytest.skip.Exception):
            yield kind, formats.whole(kind)
    write_synthetic_record(folder / "own.h5", state=Fault.OUTER, shaft_hz=10, seconds=0.2, seed=1)
    yield "own", (folder / "own.h5").read_bytes()
    yield "excerpt", files.excerpt(folder / "OR_877rpm.mat").read_bytes()
    yield "rig v5", files.rig_v5(folder / "IR_727rpm_124.8kN_0kN.mat", files.rig_signals()).read_bytes()
    yield "rig v7.3", files.rig_v73(folder / "H_727rpm_124.8kN_0kN.mat", files.rig_signals()).read_bytes()
    for version, part in itertools.product(("earliest", "latest"), HDF5_PARTS):
        name = f"hdf5 {version} {part.__name__}"
        with h5py.File(folder / name, "w", libver=version) as file:
            file.attrs["fs_hz"] = 1000.0
            part(file)
        yield name, (folder / name).read_bytes()


def _hdf5_types(file: h5py.File) -> None:
    file["x"], file["name"], file["short"] = files.vibration(300), "hello", np.bytes_(b"fixed")
    file["x"].attrs.update({"units": "m/s2", "note": "of variable length", "MATLAB_class": np.bytes_(b"double")})
    file["names"], file["fields"] = ["one", "two"], np.zeros(5, [("a", "f8"), ("b", "i2", (3,)), ("c", "S4")])
    file["switch"], file["whole"], file["pair"] = True, np.arange(300, dtype=">i2"), np.ones(4) * 1j
    file.create_dataset("enum", data=np.arange(2), dtype=h5py.enum_dtype({"A": 0, "B": 1}))
    file.create_dataset("lists", 3, h5py.vlen_dtype(np.dtype("i4")))[0] = np.arange(3)
    file.attrs.update({"array": np.arange(5.0), "lists": ["a", "bb"], "reference": file["x"].ref})


def _hdf5_references(file: h5py.File) -> None:
    file.attrs["MATLAB_class"] = np.bytes_(b"struct")
    held = file.create_group("#refs#")
    held["a"], held["b"] = files.vibration(300)[None], np.array([[104], [105]], np.uint16)
    held["b"].attrs["MATLAB_class"] = np.bytes_(b"char")
    cell = file.create_dataset("cell", (1, 2), dtype=h5py.ref_dtype)
    cell[0, 0], cell[0, 1] = held["a"].ref, held["b"].ref
    file["region"], file["soft"] = held["a"].regionref[0, :10], h5py.SoftLink("/cell")


def _hdf5_chunks(file: h5py.File) -> None:
    """Every index of chunks: B-tree, single chunk, fixed array, extensible array, B-tree of version 2."""
    samples = files.vibration(1200)
    file.create_dataset("x", data=samples, chunks=(300,), compression="gzip", shuffle=True, fletcher32=True)
    file.create_dataset("one", data=samples, chunks=(1200,), compression="gzip")
    file.create_dataset("grows", data=samples, chunks=(20,), maxshape=(None,))
    file.create_dataset("both", data=samples.reshape(40, 30), chunks=(10, 10), maxshape=(None, None))
    file.create_dataset("scaled", data=np.arange(600), chunks=(100,), scaleoffset=0)


def _hdf5_many(file: h5py.File) -> None:
    """Heaps and trees of links and attributes."""
    file["x"] = files.vibration(300)
    group = file.create_group("many", track_order=True)
    for i in range(40):
        group[f"link{i}"] = h5py.SoftLink("/x") if i % 2 else file["x"]
        file["x"].attrs[f"attribute{i}"] = i
        file.attrs[f"number{i}"] = float(i) if i % 3 else f"text {i}"


HDF5_PARTS: tuple[Callable[[h5py.File], None], ...] = (_hdf5_types, _hdf5_references, _hdf5_chunks, _hdf5_many)


@numba.njit(cache=False)
def lookup3(data: np.ndarray, length: int) -> int:
    """Jenkins's hash of the first `length` bytes, the checksum of HDF5's structures (its File Format Specification)."""
    mask = np.uint64(0xFFFFFFFF)
    s = np.full(3, (0xDEADBEEF + length) & 0xFFFFFFFF, dtype=np.uint64)
    for at in range(0, length, 12):
        for k in range(min(12, length - at)):
            s[k // 4] = (s[k // 4] + (np.uint64(data[at + k]) << np.uint64(8 * (k % 4)))) & mask
        if length - at > 12:
            for minus, plus, turn in ((2, 1, 4), (0, 2, 6), (1, 0, 8), (2, 1, 16), (0, 2, 19), (1, 0, 4)):
                first = (minus + 1) % 3
                s[first] = (s[first] - s[minus]) & mask
                s[first] ^= ((s[minus] << np.uint64(turn)) | (s[minus] >> np.uint64(32 - turn))) & mask
                s[minus] = (s[minus] + s[plus]) & mask
    for to, by, turn in ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24)):
        s[to] ^= s[by]
        s[to] = (s[to] - (((s[by] << np.uint64(turn)) | (s[by] >> np.uint64(32 - turn))) & mask)) & mask
    return s[2]


@numba.njit(cache=False)
def checked_length(data: np.ndarray, most: int) -> int:
    """How many bytes from the beginning are followed by their checksum; 0 where none are."""
    for length in range(8, min(most, len(data)) - 4):
        stored = np.uint64(0)
        for k in range(4):
            stored |= np.uint64(data[length + k]) << np.uint64(8 * k)
        if lookup3(data, length) == stored:
            return length
    return 0
