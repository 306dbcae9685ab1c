"""Damaged and hostile files: one clear `DataError`, never a crash, a hang, or anything executed."""

from __future__ import annotations

import os
import pickle
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import load_recording, write_stand_in

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
    (tmp_path / "a.mat").write_bytes(b"PK\x03\x04" + bytes(range(256)) * 4)
    refused(tmp_path / "a.mat", "no known recording. Accepted: .*MATLAB")


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
    write_stand_in(tmp_path / "s.h5", state=Fault.OUTER, shaft_hz=10, seconds=1, seed=1)
    whole = (tmp_path / "s.h5").read_bytes()
    for keep in (9, 100, 1000, len(whole) // 2, len(whole) - 1):
        (tmp_path / "cut.h5").write_bytes(whole[:keep])
        refused(tmp_path / "cut.h5", "truncated or damaged")


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


def test_npy_with_a_huge_claim(tmp_path: Path) -> None:
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }".ljust(117) + "\n"
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", 118) + header.encode() + b"\0" * 64)
    refused(tmp_path / "a.npy")


def test_hdf5_with_a_huge_claim(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", shape=(10**12,), dtype="f8", chunks=(1024,))
        file.attrs["fs_hz"] = 1000.0
    refused(tmp_path / "a.h5", "claims 8000000000000 bytes")


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
    refused(tmp_path / "a.csv", "no table of numbers")
