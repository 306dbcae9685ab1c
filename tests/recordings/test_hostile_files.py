"""Damaged and hostile files: one clear `DataError`, never a crash, a hang, or anything executed."""

from __future__ import annotations

import math
import os
import pickle
import struct
import sys
import warnings
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import load_recording, write_synthetic_record
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.loaders.limited import end_readers

from . import files

HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def refused(path: Path, match: str | None = None) -> str:
    with pytest.raises(DataError, match=match) as caught:
        load_recording(path)
    text = str(caught.value)
    assert "Traceback" not in text
    assert "\n" not in text
    return text


def test_missing_folder_empty(tmp_path: Path) -> None:
    refused(tmp_path / "none.mat", "no such file")
    refused(tmp_path, "folder")
    (tmp_path / "empty.mat").touch()
    refused(tmp_path / "empty.mat", "empty")


def test_text_named_mat(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_text("this is no recording\nat all\n")
    refused(tmp_path / "a.mat", "text file")


def test_binary_of_no_kind(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(b"XK\x03\x04" + bytes(range(256)) * 4)
    refused(tmp_path / "a.mat", "not a known recording format. Accepted: .*MATLAB")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_named_pipe_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mat")
    refused(tmp_path / "pipe.mat", "not a regular file")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_sample_that_is_not_finite_is_located(tmp_path: Path, bad: float) -> None:
    samples = files.vibration()
    samples[1234] = bad
    refused(files.excerpt(tmp_path / "OR_877rpm.mat", acc_m_s2=samples), r"acc_m_s2: sample 1234 of 4096 is")


def test_no_numeric_vector(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"note": "hello", "x": 3.0, "z": files.vibration() * 1j})
    refused(tmp_path / "a.mat", "without a numeric vector")


@pytest.mark.parametrize("keep", [64, 127, 135, 140, 300, 5000, 40000])
def test_truncated_matlab(tmp_path: Path, keep: int) -> None:
    whole = files.excerpt(tmp_path / "OR_877rpm.mat").read_bytes()
    (tmp_path / "cut.mat").write_bytes(whole[:keep])
    refused(tmp_path / "cut.mat")


def test_truncated_hdf5(tmp_path: Path) -> None:
    write_synthetic_record(tmp_path / "s.h5", state=Fault.OUTER, shaft_hz=10, seconds=1, seed=1)
    whole = (tmp_path / "s.h5").read_bytes()
    for keep in (9, 100, 1000, len(whole) // 2, len(whole) - 1):
        (tmp_path / "cut.h5").write_bytes(whole[:keep])
        refused(tmp_path / "cut.h5", "truncated or damaged|its checksum is gone")


def test_pickled_npy_is_not_opened(tmp_path: Path) -> None:
    trap = tmp_path / "executed"

    class Trap:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(trap),)

    box = np.empty(1, dtype=object)
    box[0] = Trap()
    np.save(tmp_path / "a.npy", box, allow_pickle=True)
    refused(tmp_path / "a.npy")
    (tmp_path / "b.npy").write_bytes(pickle.dumps(Trap()))
    refused(tmp_path / "b.npy")
    assert not trap.exists()


def npy(path: Path, header: str, data: bytes, version: bytes = b"\x01\x00") -> Path:
    length = struct.pack("<H" if version[0] == 1 else "<I", len(header))
    path.write_bytes(b"\x93NUMPY" + version + length + header.encode("latin-1") + data)
    return path


PLAIN = "{{'descr': {}, 'fortran_order': False, 'shape': {}, }}"


@pytest.mark.parametrize(
    "header",
    [
        *(PLAIN.format("'<f8'", shape) for shape in ("(1000000000000,)", "(-8,)", "(-2, -4)", f"({2**32}, {2**32})")),
        *(PLAIN.format("'<f8'", shape) for shape in (f"({2**61 + 8},)", f"({'1,' * 70})", "(8.0,)", "(7,)", "(9,)")),
        *(PLAIN.format(kind, "(8,)") for kind in ("'|O'", "'<M8[ns]'", "[('a', '<f8')]", "('<f8', (10**8,))", "'?8'")),
        *(PLAIN.format("'<f8'", shape) for shape in (f"({'9' * 5000},)", "-" * 9000 + "8")), "(" * 9000, "1+" * 4900,
        "not " * 2400 + "1", "a" + ".b" * 4900, "{" * 150 + "}" * 150, "\xff" * 9999, " " * 60000, "\0" * 64,
    ],
    ids=str,
)  # fmt: skip
@pytest.mark.parametrize("version", [b"\x01\x00", b"\x02\x00", b"\x03\x00"], ids=["1", "2", "3"])
def test_npy_with_a_hostile_header(tmp_path: Path, header: str, version: bytes) -> None:
    """Refused without a warning, as NumPy gives one where a product of dimensions overflows."""
    path = npy(tmp_path / "a.npy", header, bytes(64), version)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        refused(path)
    assert not caught


def test_npy_whose_header_hides_samples(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", files.vibration())
    data = (tmp_path / "a.npy").read_bytes().replace(b"(4096,)", b"(4032,)")
    (tmp_path / "a.npy").write_bytes(data)
    refused(tmp_path / "a.npy", r"header claims 4032 values \(float64\) in 32768 bytes")


@pytest.mark.parametrize("shape", [(10**12,), (2**32, 2**32), (2**62,)])
def test_hdf5_with_a_huge_claim(tmp_path: Path, shape: tuple[int, ...]) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", shape=shape, dtype="f8", chunks=(1024,) * len(shape))
        file.attrs["fs_hz"] = 1000.0
    refused(tmp_path / "a.h5", f"claims {8 * math.prod(shape)} bytes")


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


def test_hdf5_with_huge_chunks(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("x", (4000,), "f8", chunks=(2**28,), maxshape=(None,), compression="gzip")
        data.id.write_direct_chunk((0,), many_zeros(2**31))
        file.attrs["fs_hz"] = 1000.0
    assert (tmp_path / "a.h5").stat().st_size < 3e6
    refused(tmp_path / "a.h5", "a chunk of dataset 'x' claims 2147483648 bytes")


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux")
def test_hdf5_chunk_that_expands_beyond_its_claim(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("x", (4000,), "f8", chunks=(4000,), compression="gzip")
        data.id.write_direct_chunk((0,), many_zeros(2**30))
    end_readers()
    refused(tmp_path / "a.h5", "truncated or damaged|memory")
    assert reader_peak_bytes() < 450 * 2**20
    end_readers()


def reader_peak_bytes() -> int:
    """Most memory that the process which reads has held."""
    (reader,) = limited._idle
    return int(Path(f"/proc/{reader.pid}/status").read_text().split("VmHWM:")[1].split()[0]) * 1024


@pytest.mark.parametrize("group", ["/", "/a"])
def test_hdf5_with_20000_links(tmp_path: Path, group: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = files.vibration()
        for i in range(20_000):
            file.require_group(group)[f"l{i}"] = h5py.SoftLink("/x")
    refused(tmp_path / "a.h5", "2000[0-9] or more links, .* 4096 are read at most")


def test_hdf5_with_links_in_many_groups(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for i in range(12_000):
            file.require_group(f"g{i // 1000}")[f"l{i}"] = h5py.SoftLink("/x")
    refused(tmp_path / "a.h5", "[45][0-9]{3} or more links, references and attributes; 4096")


def test_hdf5_attributes_that_are_no_numbers_are_not_read(tmp_path: Path) -> None:
    """Arrays, fields and lists of any size cost nothing; a text out of proportion to the file is refused."""
    pair, number = np.dtype([("a", "f8"), ("b", "S1000")]), h5py.h5t.NATIVE_DOUBLE
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file["x"] = files.vibration()
        file["x"].attrs["units"] = "mm/s2"
        file.attrs.update({"fs_hz": 1000.0, "array": np.zeros(10**6), "pair": np.zeros(3, pair), "many": ["a"] * 9})
        for name, kind in ((b"list", h5py.h5t.array_create(number, (5,))), (b"lengths", h5py.h5t.vlen_create(number))):
            h5py.h5a.create(file.id, name, kind, h5py.h5s.create(h5py.h5s.SCALAR))
        file.attrs.create("switch", True)
    raw = detect_format(tmp_path / "a.h5").load(tmp_path / "a.h5")
    assert dict(raw.attributes) == {"fs_hz": 1000.0}
    assert dict(raw.units) == {"x": "mm/s2"}
    with h5py.File(tmp_path / "b.h5", "w", libver="latest") as file:
        file["x"] = files.vibration()
        for i in range(5000):
            file.attrs[f"a{i}"] = i
    refused(tmp_path / "b.h5", "5001 or more links, references and attributes; 4096")


@pytest.mark.parametrize("filters", ["unknown", "many"])
def test_hdf5_filters(tmp_path: Path, filters: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        settings.set_chunk((4096,))
        if filters == "unknown":
            settings.set_filter(32768, h5py.h5z.FLAG_OPTIONAL, ())
        for _ in range(8 if filters == "many" else 0):
            settings.set_deflate(9)
        space = h5py.h5s.create_simple((4096,))
        data = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, space, settings)
        data.write_direct_chunk((0,), files.vibration().tobytes(), 0)
        file["other"] = files.vibration()
        file.attrs["fs_hz"] = 1000.0
    match = "filter 32768, not installed. Decompress: h5repack" if filters == "unknown" else "compressed by 8 filters"
    refused(tmp_path / "a.h5", match)


def test_compressed_bomb(tmp_path: Path) -> None:
    zeros = 1 << 30
    matrix = struct.pack("<II", 14, zeros)
    squeeze = zlib.compressobj(9)
    body = squeeze.compress(matrix) + b"".join(squeeze.compress(bytes(1 << 20)) for _ in range(64)) + squeeze.flush()
    (tmp_path / "a.mat").write_bytes(HEADER + struct.pack("<II", 15, len(body)) + body)
    refused(tmp_path / "a.mat", "claims")


@pytest.mark.parametrize("dimensions", [(2**31 - 1, 2**31 - 1), (2**30, 1), (-1, 1)])
@pytest.mark.parametrize("kind", [6, 1, 2, 4])  # double, cell, struct, char
def test_matlab_array_with_huge_dimensions(tmp_path: Path, dimensions: tuple[int, int], kind: int) -> None:
    body = struct.pack("<IIII", 6, 8, kind, 0) + struct.pack("<IIii", 5, 8, *dimensions)
    body += struct.pack("<II", 1, 1) + b"x".ljust(8, b"\0") + struct.pack("<II", 9, 16) + bytes(16)
    (tmp_path / "a.mat").write_bytes(HEADER + struct.pack("<II", 14, len(body)) + body)
    refused(tmp_path / "a.mat")


def test_links_out_of_the_file_and_in_circles_are_not_followed(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["x"] = files.vibration()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["loop"] = h5py.SoftLink("/")
        file["out"] = h5py.ExternalLink("secret.h5", "/x")
    refused(tmp_path / "a.h5", "without a numeric vector")


@pytest.mark.parametrize("kind", [None, "stand-in"])
def test_hdf5_chunks_never_written(tmp_path: Path, kind: str | None) -> None:
    name = "acceleration_m_s2" if kind else "x"
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset(name, (4000,), "f8", chunks=(1000,))
        data[:1000] = files.vibration(1000)
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


def test_dimension_without_values(tmp_path: Path) -> None:
    """As netCDF-4 writes a dimension that has no coordinates: a data set that is never written, and no variable."""
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["x"] = files.vibration()
        file.create_dataset("sample", (4096,), ">f4").make_scale(
            "This is a netCDF dimension but not a netCDF variable.      4096"
        )
        file["x"].dims[0].attach_scale(file["sample"])
        file.attrs["fs_hz"] = 1000.0
    assert load_recording(tmp_path / "a.nc", unit="g").channel == "x"


def test_a_struct_never_written(tmp_path: Path) -> None:
    path = files.rig_v73(tmp_path / "H_727rpm_124.8kN_0kN.mat", files.rig_signals())
    with h5py.File(path, "r+") as file:
        values = file[file["Signal_3/y_values/values"][0, 0]]
        shape, names = values.shape, [n for n in file["#refs#"] if file["#refs#"][n] == values]
        del file["#refs#"][names[0]]
        empty = file["#refs#"].create_dataset(names[0], shape, "f8", chunks=(1, shape[1] // 2))
        empty[:, : shape[1] // 2] = 1.0
        file["Signal_3/y_values/values"][0, 0] = empty.ref
    refused(path, r"4 of 8 chunks of 'Signal_3\.y_values\.values' were never written \(50 %")


def test_deeply_nested_cells(tmp_path: Path) -> None:
    value: object = files.vibration()
    for _ in range(200):
        value = files.nested(value)
    savemat(tmp_path / "a.mat", {"x": value})
    refused(tmp_path / "a.mat")


def test_hard_link_circle_ends(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("a")
        group["again"] = group
    refused(tmp_path / "a.h5", "nested deeper")


def test_text_of_one_endless_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1," * 2_000_000)
    refused(tmp_path / "a.csv", "not a table of numbers")
