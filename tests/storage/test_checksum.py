"""A file with its checksum is what was written, or an error; to HDF5 readers it is an HDF5 file like any other."""

from __future__ import annotations

import contextlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.synthetic_record import write_synthetic_record
from srbval.storage.hdf5_files import END_BYTES, append_checksum, checked_summary

STEP = 397  # bytes between flipped bits


def test_every_byte_counts(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"content" * 3)
    assert checked_summary(path) is None
    append_checksum(path, b"summary\n")
    assert checked_summary(path) == b"summary\n"
    whole = path.read_bytes()
    for at in range(8 * len(whole)):
        raw = bytearray(whole)
        raw[at // 8] ^= 1 << at % 8
        path.write_bytes(raw)
        with contextlib.suppress(DataError):
            assert checked_summary(path) is None  # the mark itself is hit
            assert at // 8 >= len(whole) - END_BYTES
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        assert checked_summary(path) is None


@pytest.fixture
def stand_in(tmp_path: Path) -> Path:
    write_synthetic_record(tmp_path / "s.h5", state=Fault.OUTER, shaft_hz=14.3, seconds=0.5, seed=1)
    return tmp_path / "s.h5"


def test_own_files_are_refused_when_a_bit_has_flipped(stand_in: Path) -> None:
    whole = stand_in.read_bytes()
    for at in range(0, len(whole), len(whole) // 10):
        raw = bytearray(whole)
        raw[at] ^= 4
        stand_in.write_bytes(raw)
        with pytest.raises(DataError, match=r"damaged|not a known recording"):
            load_recording(stand_in)
    stand_in.write_bytes(whole[:-1])
    with pytest.raises(DataError, match="its checksum is gone"):
        load_recording(stand_in)
    stand_in.write_bytes(whole)
    assert "checksum" not in " ".join(load_recording(stand_in).notes)


def test_a_file_of_an_earlier_version_is_read_with_a_note(stand_in: Path) -> None:
    before = load_recording(stand_in)
    with h5py.File(stand_in, "r+") as file:
        del file.attrs["srbval_checksum"]
    after = load_recording(stand_in)
    assert "no checksum" in " ".join(after.notes)
    np.testing.assert_array_equal(before.channels["acceleration"], after.channels["acceleration"])


def test_other_readers_read_it_and_notice_damage_of_the_samples(stand_in: Path) -> None:
    with h5py.File(stand_in) as file:
        dataset = file["acceleration_m_s2"]
        assert (dataset.fletcher32, file["time_s"].fletcher32) == (True, True)
        offset = dataset.id.get_chunk_info(0).byte_offset
        values = dataset[()]
    with xarray.open_dataset(stand_in, engine="h5netcdf") as found:
        np.testing.assert_array_equal(found["acceleration_m_s2"], values)
    raw = bytearray(stand_in.read_bytes())
    raw[offset + 9] ^= 1
    stand_in.write_bytes(raw)
    with h5py.File(stand_in) as file, pytest.raises(OSError, match=r"filter|error detection"):
        file["acceleration_m_s2"][()]
