"""Hostile files of every kind: one clear `DataError`, never a crash, a hang, or anything executed."""

import math
import os
import pickle
import struct
import sys
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.loaders.limited import end_readers
from srbval.recordings.synthetic_record import write_synthetic_record

from . import files
from .damage import Trap


def refused(path: Path, match: str | None = None) -> None:
    with pytest.raises(DataError, match=match) as caught:
        load_recording(path)
    assert "Traceback" not in str(caught.value)
    assert "\n" not in str(caught.value)


def mat(path: Path, **values: object) -> None:
    savemat(path, values)


def hdf5(path: Path, **values: object) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["fs_hz"] = 1000.0
        for name, value in values.items():
            file[name] = value


def excerpt_with(bad: float) -> Callable[[Path], object]:
    samples = files.vibration()
    samples[1234] = bad
    return lambda path: files.excerpt(path, acc_m_s2=samples)


def nested_cells(path: Path) -> None:
    value: object = files.vibration()
    for _ in range(200):
        value = files.nested(value)
    savemat(path, {"x": value})


def circle(path: Path) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("a")
        group["again"] = group


def npy_with_hidden_samples(path: Path) -> None:
    np.save(path.with_suffix(".npy"), files.vibration())
    path.write_bytes(path.with_suffix(".npy").read_bytes().replace(b"(4096,)", b"(4032,)"))


def numbers_that_do_not_fit(path: Path) -> None:
    savemat(path, {"x": np.ones((700, 3))})
    path.write_bytes(path.read_bytes().replace(struct.pack("<ii", 700, 3), struct.pack("<ii", 699, 3)))


def damaged_compressed(path: Path) -> None:
    savemat(path, {"x": files.vibration()}, do_compression=True)
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


CASES: dict[str, tuple[Callable[[Path], object], str]] = {
    "folder": (lambda path: path.mkdir(), "folder"),
    "empty": (lambda path: path.touch(), "empty"),
    "text": (lambda path: path.write_text("this is no recording\nat all\n"), "text file"),
    "one endless line": (lambda path: path.write_text("1," * 2_000_000), "not a table of numbers"),
    "no kind": (lambda path: path.write_bytes(b"XK\x03\x04" + bytes(999)), "not a known recording format. Accepted: "),
    "nan": (excerpt_with(np.nan), r"acc_m_s2: sample 1234 of 4096 is nan"),
    "inf": (excerpt_with(-np.inf), r"acc_m_s2: sample 1234 of 4096 is -inf"),
    "no vector": (lambda path: mat(path, note="a", x=3.0, z=files.vibration() * 1j), "without a numeric vector"),
    "nested cells": (nested_cells, "nested|beyond|MATLAB v5"),
    "MATLAB numbers": (numbers_that_do_not_fit, "truncated or damaged MATLAB v5 file"),
    "MATLAB checksum": (damaged_compressed, "truncated or damaged MATLAB v5 file .*incorrect data check"),
    "circle": (circle, "nested deeper"),
    "npy": (npy_with_hidden_samples, r"header claims 4032 values \(float64\) in 32768 bytes"),
}


@pytest.mark.parametrize(("write", "match"), CASES.values(), ids=CASES.keys())
def test_refused_and_said_why(tmp_path: Path, write: Callable[[Path], object], match: str) -> None:
    write(tmp_path / "a.mat")
    refused(tmp_path / "a.mat", match)


def test_missing_and_pipe(tmp_path: Path) -> None:
    refused(tmp_path / "none.mat", "no such file")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.mat")
        refused(tmp_path / "pipe.mat", "not a regular file")


def test_own_file_that_was_cut(tmp_path: Path) -> None:
    write_synthetic_record(tmp_path / "s.h5", state=Fault.OUTER, shaft_hz=10, seconds=1, seed=1)
    whole = (tmp_path / "s.h5").read_bytes()
    for keep in (9, 1000, len(whole) - 1):
        (tmp_path / "cut.h5").write_bytes(whole[:keep])
        refused(tmp_path / "cut.h5", "truncated or damaged|its checksum is gone")


def test_pickled_npy_is_not_opened(tmp_path: Path) -> None:
    box = np.empty(1, dtype=object)
    box[0] = Trap(tmp_path / "executed")
    np.save(tmp_path / "a.npy", box, allow_pickle=True)
    refused(tmp_path / "a.npy")
    (tmp_path / "b.npy").write_bytes(pickle.dumps(box[0]))
    refused(tmp_path / "b.npy")
    assert not (tmp_path / "executed").exists()


PLAIN = "{{'descr': {}, 'fortran_order': False, 'shape': {}, }}"


@pytest.mark.parametrize(
    "header",
    [
        *(PLAIN.format("'<f8'", shape) for shape in ("(1000000000000,)", "(-8,)", f"({2**32}, {2**32})", "(8.0,)")),
        *(PLAIN.format("'<f8'", shape) for shape in (f"({2**61 + 8},)", f"({'1,' * 70})", "(9,)", f"({'9' * 5000},)")),
        *(PLAIN.format(kind, "(8,)") for kind in ("'|O'", "'<M8[ns]'", "('<f8', (10**8,))")),
        "(" * 9000, "1+" * 4900, "a" + ".b" * 4900, "{" * 150 + "}" * 150, "\xff" * 9999, "\0" * 64,
    ],
    ids=range(17),
)  # fmt: skip
@pytest.mark.parametrize("version", [b"\x01\x00", b"\x03\x00"], ids=["1", "3"])
def test_npy_with_a_hostile_header(tmp_path: Path, header: str, version: bytes) -> None:
    """Refused without a warning, as NumPy gives one where a product of dimensions overflows."""
    length = struct.pack("<H" if version[0] == 1 else "<I", len(header))
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY" + version + length + header.encode("latin-1") + bytes(64))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused(tmp_path / "a.npy")


def many_zeros(count: int) -> bytes:
    """A stream of `count` zeros, which compresses a block of them but once."""
    block = bytes(2**24)
    first = zlib.compressobj(9)
    start = first.compress(block) + first.flush(zlib.Z_FULL_FLUSH)
    again = zlib.compressobj(9, wbits=-15)
    middle = again.compress(block) + again.flush(zlib.Z_FULL_FLUSH)
    checksum = 1
    for _ in range(count // len(block)):
        checksum = zlib.adler32(block, checksum)
    return start + middle * (count // len(block) - 1) + b"\x03\x00" + struct.pack(">I", checksum)


@pytest.mark.parametrize(
    ("chunk", "zeros", "match"),
    [
        (2**28, 2**26, "a chunk of dataset 'x' claims 2147483648 bytes"),
        pytest.param(
            4000, 2**29, "truncated or damaged|memory",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux"),
        ),
    ],
)  # fmt: skip
def test_hdf5_chunks_that_expand(tmp_path: Path, chunk: int, zeros: int, match: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("x", (4000,), "f8", chunks=(chunk,), maxshape=(None,), compression="gzip")
        data.id.write_direct_chunk((0,), many_zeros(zeros))
    end_readers()
    refused(tmp_path / "a.h5", match)
    (reader,) = limited._idle
    if sys.platform == "linux":
        status = Path(f"/proc/{reader.pid}/status").read_text()
        assert int(status.split("VmHWM:")[1].split()[0]) * 1024 < 450 * 2**20
    end_readers()


@pytest.mark.parametrize("groups", [1, 5])
def test_hdf5_with_very_many_links(tmp_path: Path, groups: int) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for i in range(5_000):
            file.require_group(f"g{i % groups}")[f"l{i}"] = h5py.SoftLink("/x")
    refused(tmp_path / "a.h5", "[0-9]{4} or more links, references and attributes; 4096 are read at most")


def test_hdf5_attributes_that_are_no_numbers_are_not_read(tmp_path: Path) -> None:
    """Arrays, fields and lists of any size cost nothing; too many are refused."""
    pair, number = np.dtype([("a", "f8"), ("b", "S1000")]), h5py.h5t.NATIVE_DOUBLE
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file["x"] = files.vibration()
        file["x"].attrs["units"] = "mm/s2"
        file.attrs.update({"fs_hz": 1000.0, "array": np.zeros(10**6), "pair": np.zeros(3, pair), "many": ["a"] * 9})
        for name, kind in ((b"list", h5py.h5t.array_create(number, (5,))), (b"lengths", h5py.h5t.vlen_create(number))):
            h5py.h5a.create(file.id, name, kind, h5py.h5s.create(h5py.h5s.SCALAR))
    raw = detect_format(tmp_path / "a.h5").load(tmp_path / "a.h5")
    assert (dict(raw.attributes), dict(raw.units)) == ({"fs_hz": 1000.0}, {"x": "mm/s2"})
    with h5py.File(tmp_path / "a.h5", "r+", libver="latest") as file:
        for i in range(5000):
            file.attrs[f"a{i}"] = i
    refused(tmp_path / "a.h5", "[0-9]{4} or more links, references and attributes; 4096")


@pytest.mark.parametrize(
    ("filters", "match"),
    [([32768], "filter 32768, not installed. Decompress: h5repack"), ([1] * 8, "compressed by 8 filters")],
)
def test_hdf5_filters(tmp_path: Path, filters: list[int], match: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        settings.set_chunk((4096,))
        for number in filters:
            settings.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (9,) if number == 1 else ())
        data = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((4096,)), settings)
        data.write_direct_chunk((0,), files.vibration().tobytes(), 0)
    refused(tmp_path / "a.h5", match)


@pytest.mark.parametrize("kind", [None, "stand-in"])
def test_hdf5_chunks_never_written(tmp_path: Path, kind: str | None) -> None:
    name = "acceleration_m_s2" if kind else "x"
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset(name, (4000,), "f8", chunks=(1000,))[:1000] = files.vibration(1000)
        file.attrs.update({"fs_hz": 1000.0, "unit": "m/s2"} | ({"srbval_kind": kind} if kind else {}))
    refused(tmp_path / "a.h5", rf"3 of 4 chunks of '{name}' were never written \(75 % of its samples\); copy")


@pytest.mark.parametrize("used", ["x", "time", "fs", "spare"])
def test_hdf5_datasets_never_written(tmp_path: Path, used: str) -> None:
    """Refused where they are used, in the way of a signal, a time and a number; a text beside them is not."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        if used != "x":
            file["x"] = files.vibration()
        file.create_dataset(used, {"fs": (), "spare": (9,)}.get(used, (4096,)), "f8")
        file.attrs["fs_hz" if used != "time" else "note"] = 1000.0
    if used == "spare":
        assert load_recording(tmp_path / "a.h5", unit="g").samples == 4096
    else:
        refused(tmp_path / "a.h5", f"1 of 1 chunks of '{used}' were never written \\(100 % of its samples\\)")


def test_links_out_of_the_file_and_in_circles_are_not_followed(tmp_path: Path) -> None:
    hdf5(tmp_path / "secret.h5", x=files.vibration())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["loop"], file["out"] = h5py.SoftLink("/"), h5py.ExternalLink("secret.h5", "/x")
    refused(tmp_path / "a.h5", "without a numeric vector")


@pytest.mark.parametrize("shape", [(10**12,), (2**32, 2**32), (2**62,)])
def test_hdf5_with_a_huge_claim(tmp_path: Path, shape: tuple[int, ...]) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", shape=shape, dtype="f8", chunks=(1024,) * len(shape))
    refused(tmp_path / "a.h5", f"claims {8 * math.prod(shape)} bytes")


def test_a_struct_never_written(tmp_path: Path) -> None:
    path = files.rig_v73(tmp_path / "H_727rpm_124.8kN_0kN.mat", files.rig_signals())
    with h5py.File(path, "r+") as file:
        shape = file[file["Signal_3/y_values/values"][0, 0]].shape
        empty = file["#refs#"].create_dataset("half", shape, "f8", chunks=(1, shape[1] // 2))
        empty[:, : shape[1] // 2] = 1.0
        file["Signal_3/y_values/values"][0, 0] = empty.ref
    refused(path, r"4 of 8 chunks of 'Signal_3\.y_values\.values' were never written \(50 %")


def test_dimension_without_values(tmp_path: Path) -> None:
    """As netCDF-4 writes a dimension that has no coordinates: a data set that is never written, and no variable."""
    hdf5(tmp_path / "a.nc", x=files.vibration())
    with h5py.File(tmp_path / "a.nc", "r+") as file:
        scale = "This is a netCDF dimension but not a netCDF variable.      4096"
        file.create_dataset("sample", (4096,), ">f4").make_scale(scale)
        file["x"].dims[0].attach_scale(file["sample"])
    assert load_recording(tmp_path / "a.nc", unit="g").channel == "x"
