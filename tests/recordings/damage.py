"""Damaged and hostile files without end: seeded, of every format that has a loader."""

from __future__ import annotations

import os
import pickle
import struct
import zlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.recordings import write_synthetic_record

from . import files
from .hdf5_damage import StructureDamage

HOSTILE = (
    "", " ", "\x00", "\x1b[2J\x1b]0;owned\x07", "a\nb\r\nc", "../../../../etc/passwd", "$(touch owned)", "'; rm -rf /",
    "%s%s%s%n", "{0.__class__}", "\u202e\ufeff\ud7ff", "é" * 5000, "A" * 70000, "nan", "1e999", "-0", "__class__",
)  # fmt: skip
DTYPES = ("i1", "u2", "i8", "f4", "c16", "?", "U3", ">f8", "f8")


HDF5_TYPES = (
    lambda: h5py.h5t.IEEE_F64BE, lambda: h5py.h5t.STD_U16LE, lambda: h5py.h5t.IEEE_F16LE, lambda: h5py.h5t.STD_REF_OBJ,
    lambda: h5py.h5t.STD_REF_DSETREG, lambda: h5py.h5t.STD_B32LE, lambda: h5py.h5t.UNIX_D32LE,
    lambda: h5py.h5t.array_create(h5py.h5t.IEEE_F64LE, (3, 50)), lambda: h5py.h5t.vlen_create(h5py.h5t.IEEE_F64LE),
    lambda: h5py.h5t.vlen_create(h5py.h5t.vlen_create(h5py.h5t.STD_I8LE)), lambda: h5py.h5t.create(h5py.h5t.OPAQUE, 9),
    *(lambda kind=kind: h5py.h5t.py_create(kind, logical=True) for kind in (
        h5py.string_dtype(), h5py.string_dtype("ascii", 5000), h5py.enum_dtype({"A": 0, "B": 1}), np.dtype("c16"),
        np.dtype("?"), np.dtype([("a", "f8"), ("b", "i4", (2, 2)), ("c", "S9")]), np.dtype("g"),
    )),
)  # fmt: skip
NPY_TYPES = (
    "'<f8'", "'<f8'", "'>i2'", "'|O'", "'|V8'", "'<U9'", "'<M8[ns]'", "'c16'", "'f16'", "'f0'", "8", "None", "''",
    "[('a', '<f8')]", "[('a', '|O')]", "('<f8', (9,))", "('<f8', (10**9,))", "'f8,f8'", "[[[]]]", "{'a': 1}", "b'<f8'",
)  # fmt: skip
NPY_SHAPES = (
    "(4096,)", "(4096,)", "(8,)", "(0,)", "()", "(-1,)", "(-8, -512)", "(2**12,)", "(4096.0,)", "(True,)", "4096",
    f"({2**63},)", f"({2**61 + 4096},)", f"({2**32}, {2**32})", f"({'9' * 4999},)", f"({'1,' * 70})", "(1, 4096)",
    "[4096]", "('4096',)", "(4096L,)", "(0, -1)", f"(0, {2**63})", f"({2**62}, 0)",
)  # fmt: skip
NPY_NESTED = tuple(
    open_ * 5000 + "1" + close * 5000 for open_, close in ("()", "[]", ("-", ""), ("not ", ""), ("1+", ""))
)


class Trap:
    """Makes a folder when it is unpickled: that must never happen."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.folder),)


class Damage:
    """Writes the i-th damaged file to a path; a seed of its own for each."""

    def __init__(self, folder: Path, trap: Path, seed: int = 20260101) -> None:
        self.seed = seed
        self.trap = trap
        self.whole = _whole_files(folder)
        self.kinds = (
            *(self._flipped, self._overwritten, self._cut, self._doubled, self._tags),
            *(self._rebuilt, self._rebuilt, self._array, self._table, self._hdf5, self._pickle, self._claim),
            *(self._structure,) * 8,
            *(self._types, self._chunks),
            *(self._elements, self._elements, self._many_elements, self._header),
        )
        self._structures = StructureDamage(folder)
        self._matlab = [whole for whole in self.whole if whole.startswith(b"MATLAB 5.0")]

    def write(self, i: int, path: Path) -> str:
        """Write file `i` and say what was done to it."""
        rng = np.random.default_rng((self.seed, i))
        kind = self.kinds[i % len(self.kinds)]
        made = kind(rng, path, self.whole[int(rng.integers(len(self.whole)))])
        if isinstance(made, bytes):
            path.write_bytes(made)
        return kind.__name__

    def _flipped(self, rng: np.random.Generator, _: Path, whole: bytes) -> bytes:
        data = bytearray(whole)
        for position in rng.integers(0, min(len(data), int(rng.choice((400, 2000, 10**9)))), int(rng.integers(1, 8))):
            data[position] ^= 1 << int(rng.integers(8))
        return bytes(data)

    def _overwritten(self, rng: np.random.Generator, _: Path, whole: bytes) -> bytes:
        data = bytearray(whole)
        at, length = int(rng.integers(len(data))), int(rng.integers(1, 200))
        data[at : at + length] = rng.bytes(length) if rng.random() < 0.5 else bytes(length)
        return bytes(data)

    def _cut(self, rng: np.random.Generator, _: Path, whole: bytes) -> bytes:
        return whole[: int(rng.integers(len(whole)))] if rng.random() < 0.95 else b""

    def _doubled(self, rng: np.random.Generator, _: Path, whole: bytes) -> bytes:
        at = int(rng.integers(len(whole)))
        return whole[:at] + whole[: int(rng.integers(1, 4096))] + whole[at:]

    def _tags(self, rng: np.random.Generator, _: Path, whole: bytes) -> bytes:
        data = bytearray(whole)
        for position in rng.integers(0, min(len(data), 4000) // 4, 3):
            data[4 * position : 4 * position + 4] = struct.pack("<I", int(rng.integers(2**32)))
        return bytes(data)

    def _rebuilt(self, rng: np.random.Generator, path: Path, _: bytes) -> None:
        """A rig file whose values, types, shapes or texts are not what they should be."""
        signals = files.rig_signals()
        values = _spoilt(rng, signals["Signal_3"]["y_values"]["values"][0, 0])
        signals["Signal_3"]["y_values"]["values"] = files.nested(values) if rng.random() < 0.5 else values
        if rng.random() < 0.5:
            signals["Signal_3"]["y_values"]["quantity"]["label"] = str(rng.choice(HOSTILE))
        if rng.random() < 0.3:
            signals["Signal_2"]["x_values"]["increment"] = float(rng.choice((0.0, -1.0, np.nan, np.inf, 1e-300, 1e300)))
        if rng.random() < 0.3:
            signals["Signal_2"] = _nest(signals["Signal_2"], int(rng.integers(1, 60)))
        choice = rng.integers(3)
        if choice == 0:
            savemat(path, signals, do_compression=bool(rng.random() < 0.5))
        elif choice == 1:
            changes = {"acc_m_s2": values, "condition": str(rng.choice(HOSTILE)), "rpm": _spoilt(rng, np.ones(128))}
            files.excerpt(path, **changes)
        else:
            savemat(path, {"X105_DE_time": values, "X105RPM": _spoilt(rng, np.ones((1, 1)) * 1797)})

    def _array(self, rng: np.random.Generator, path: Path, _: bytes) -> None:
        with path.open("wb") as stream:
            np.save(stream, _spoilt(rng, files.vibration()), allow_pickle=False)

    def _table(self, rng: np.random.Generator, _: Path, __: bytes) -> bytes:
        rows = [f"{x:.4f}" for x in files.vibration(400)]
        for position in rng.integers(0, len(rows), 3):
            rows[position] = str(rng.choice(HOSTILE))
        head = f"# fs_hz = {rng.choice(HOSTILE)}\n" if rng.random() < 0.5 else ""
        return (head + str(rng.choice(("\n", ",", ";", "\t"))).join(rows)).encode("utf-8", "replace")

    def _hdf5(self, rng: np.random.Generator, path: Path, _: bytes) -> None:
        with h5py.File(path, "w") as file:
            values = _spoilt(rng, files.vibration())
            file["x"] = values.astype("S8") if values.dtype.kind == "U" else values
            text = str(rng.choice(HOSTILE)).replace("\x00", "")[:30000]
            file.attrs["srbval_kind"] = text if rng.random() < 0.5 else "stand-in"
            file.attrs["fs_hz"] = float(rng.choice((0.0, -1.0, np.nan, np.inf, 1000.0)))
            file["link"] = h5py.ExternalLink("/etc/passwd", "/x") if rng.random() < 0.5 else h5py.SoftLink("/link")

    def _pickle(self, rng: np.random.Generator, path: Path, _: bytes) -> bytes | None:
        trap = Trap(self.trap)
        if rng.random() < 0.5:
            return pickle.dumps(trap, protocol=int(rng.integers(0, 6)))
        box = np.empty(int(rng.integers(1, 4)), dtype=object)
        box[:] = trap
        with path.open("wb") as stream:
            np.save(stream, box, allow_pickle=True)
        return None

    def _structure(self, rng: np.random.Generator, _: Path, __: bytes) -> bytes:
        return self._structures.damaged(rng, int(rng.integers(len(self._structures.kinds))))

    def _types(self, rng: np.random.Generator, path: Path, _: bytes) -> None:
        """Data sets and attributes of every type, of sizes from nothing to far more than a file should hold."""
        size = int(rng.choice((0, 1, 3, 300, 70_000)))
        with h5py.File(path, "w", libver=str(rng.choice(("earliest", "latest")))) as file:
            for name in ("x", "MATLAB_class", "fs_hz", "y"):
                kind = HDF5_TYPES[int(rng.integers(len(HDF5_TYPES)))]()
                space = h5py.h5s.create_simple((size,)) if rng.random() < 0.7 else h5py.h5s.create(h5py.h5s.SCALAR)
                if rng.random() < 0.1:
                    space = h5py.h5s.create(h5py.h5s.NULL)
                settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                if rng.random() < 0.7:
                    settings.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
                h5py.h5d.create(file.id, name.encode(), kind, space, settings)
                if size * kind.get_size() < 60_000:
                    h5py.h5a.create(file.id, name.encode(), kind, space)
            if rng.random() < 0.5:
                file.attrs["srbval_kind"] = "run"

    def _chunks(self, rng: np.random.Generator, path: Path, _: bytes) -> None:
        """Chunks of any size, packed by any filters, some never written, some not what the filter expects."""
        chunk = int(2 ** rng.uniform(0, 30))
        with h5py.File(path, "w", libver=str(rng.choice(("earliest", "latest")))) as file:
            settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            settings.set_chunk((chunk,))
            for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.8 else 20):
                number, choice = int(rng.integers(1, 40000)), int(rng.integers(4))
                if choice == 0:
                    settings.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (1, 2))
                else:
                    (settings.set_shuffle, settings.set_fletcher32, settings.set_deflate)[choice - 1]()
            size = int(rng.choice((300, 4000, 10**7)))
            space = h5py.h5s.create_simple((size,), (h5py.h5s.UNLIMITED,))
            data = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, space, settings)
            packed = (zlib.compress(bytes(2**24)), zlib.compress(files.vibration(300).tobytes()), rng.bytes(2000))
            for i in range(min(int(rng.integers(0, 3)), -(-size // chunk))):
                data.write_direct_chunk((i * chunk,), packed[int(rng.integers(3))], int(rng.choice((0, 0, 1, 255))))
            file.attrs["fs_hz"] = 1000.0

    def _elements(self, rng: np.random.Generator, _: Path, __: bytes) -> bytes:
        """Numbers of a MATLAB element: types, byte counts, flags, dimensions, nested counts; packed anew."""
        whole = self._matlab[int(rng.integers(len(self._matlab)))]
        made, at = [whole[:128]], 128
        while at + 8 <= len(whole):
            kind, count = struct.unpack_from("<II", whole, at)
            body = whole[at : at + 8 + count]
            at += 8 + count
            element = bytearray(zlib.decompress(body[8:]) if kind == 15 else body)
            for _ in range(int(rng.integers(3))):
                most = min(len(element) // 4, int(rng.choice((8, 40, 400, 10**6))))
                place = 4 * int(rng.integers(most))
                old = struct.unpack_from("<I", element, place)[0]
                new = (
                    0,
                    1,
                    old + 1,
                    2 * old,
                    old ^ 0x800,
                    2**32 - 1,
                    2**31,
                    14,
                    15,
                    len(element),
                    int(rng.integers(20)),
                )
                struct.pack_into("<I", element, place, new[int(rng.integers(len(new)))] % 2**32)
            packed = zlib.compress(element)
            made.append(struct.pack("<II", 15, len(packed)) + packed if rng.random() < 0.7 else bytes(element))
        return b"".join(made)

    def _many_elements(self, rng: np.random.Generator, _: Path, __: bytes) -> bytes:
        """Very many elements that claim little and hold much, or the other way round."""
        length, count = int(10 ** rng.uniform(0, 7)), int(10 ** rng.uniform(0, 4))
        kind, claimed = int(rng.choice((1, 2, 4, 6))), int(10 ** rng.uniform(0, 7))
        body = struct.pack("<IIIIIIii", 6, 8, kind, 0, 5, 8, length, 1) + struct.pack("<II", 1, 1) + b"x".ljust(8)
        body = struct.pack("<II", 14, claimed) + body + struct.pack("<II", 2, length) + bytes(length + -length % 8)
        packed = zlib.compress(body)
        return self._matlab[0][:128] + (struct.pack("<II", 15, len(packed)) + packed) * count

    def _header(self, rng: np.random.Generator, _: Path, __: bytes) -> bytes:
        """A NumPy header of pieces that are wrong for themselves or together."""
        kind, shape = (str(rng.choice(pieces)) for pieces in (NPY_TYPES, NPY_SHAPES))
        text = f"{{'descr': {kind}, 'fortran_order': {rng.choice(('False', 'True', '0', 'None'))}, 'shape': {shape}, }}"
        text = {0: text[: int(rng.integers(len(text)))], 1: text * 90, 2: str(rng.choice(NPY_NESTED))}.get(
            int(rng.integers(12)), text
        )
        version, length = int(rng.choice((1, 1, 1, 2, 3, 9))), len(text)
        if rng.random() < 0.2:
            length = int(rng.choice((0, 1, 65535, length - 1)))
        head = b"\x93NUMPY" + bytes((version, 0)) + struct.pack("<H" if version == 1 else "<I", length)
        return head + text.encode() + bytes(int(rng.choice((0, 64, 4096, 8 * 4096))))

    def _claim(self, rng: np.random.Generator, path: Path, _: bytes) -> bytes | None:
        """A few bytes that claim gigabytes."""
        count = int(10 ** rng.uniform(8, 18))
        choice = rng.integers(4)
        if choice == 0:
            header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({count},), }}".ljust(117) + "\n"
            return b"\x93NUMPY\x01\x00" + struct.pack("<H", 118) + header.encode() + bytes(64)
        if choice == 1:
            with h5py.File(path, "w") as file:
                file.create_dataset("x", shape=(min(count, 10**15),), dtype="f8", chunks=(1024,))
                file.attrs["fs_hz"] = 1000.0
            return None
        header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
        if choice == 2:
            squeeze = zlib.compressobj(9)
            body = squeeze.compress(struct.pack("<II", 14, min(count, 2**32 - 9)) + bytes(1 << 24)) + squeeze.flush()
            return header + struct.pack("<II", 15, len(body)) + body
        body = struct.pack("<IIII", 6, 8, int(rng.integers(1, 18)), 0)
        body += struct.pack("<IIii", 5, 8, *(int(n) for n in rng.integers(-(2**31), 2**31 - 1, 2)))
        body += struct.pack("<II", 1, 1) + b"x".ljust(8, b"\0") + struct.pack("<II", 9, 16) + bytes(16)
        return header + struct.pack("<II", 14, len(body)) + body


def _whole_files(folder: Path) -> list[bytes]:
    write_synthetic_record(folder / "s.h5", state=Fault.OUTER, shaft_hz=10, seconds=0.2, seed=1)
    np.save(folder / "x.npy", files.vibration())
    np.savetxt(folder / "x.csv", files.vibration(600), fmt="%.5f")
    made = [
        files.excerpt(folder / "OR_877rpm.mat"),
        files.rig_v5(folder / "IR_727rpm_124.8kN_0kN.mat", files.rig_signals()),
        files.rig_v73(folder / "H_727rpm_124.8kN_0kN.mat", files.rig_signals()),
        files.mfpt(folder / "InnerRaceFault_vload_1.mat"),
        *(folder / name for name in ("s.h5", "x.npy", "x.csv")),
    ]
    return [path.read_bytes() for path in made]


def _spoilt(rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """Values of a wrong type, with NaN or infinity, of length zero, or of an odd shape."""
    choice = rng.integers(5)
    if choice == 0:
        with np.errstate(all="ignore"):
            return values.astype(str(rng.choice(DTYPES)))
    if choice == 1:
        spoilt = values.astype(float).copy()
        spoilt.flat[int(rng.integers(spoilt.size))] = rng.choice((np.nan, np.inf, -np.inf, 1e308))
        return spoilt
    if choice == 2:
        return values[:0]
    if choice == 3:
        return values.reshape(1, -1, *((1,) * int(rng.integers(1, 5))))
    return np.zeros_like(values, dtype=float)


def _nest(value: Any, depth: int) -> Any:
    for _ in range(depth):
        value = files.nested(value)
    return value
