"""HDF5 files: with their checksum they are what was written, or an error."""

import contextlib
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.storage.hdf5_files import END_BYTES, append_checksum, checked_summary
from tests.recordings.synthetic_record import write_synthetic_record

FULL = """
import resource, signal, sys
from pathlib import Path
from srbval.models.simulate import simulate, simulate_to_file
from srbval.errors import DataError
from srbval.scene import paper_scene

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
fractions = []
scene = paper_scene(model="kinematic", duration_s=2.0, defect={"kind": "outer"})
try:
    simulate_to_file(scene, Path(sys.argv[1]), progress=lambda _, fraction: fractions.append(fraction))
except DataError as error:
    print(error, max(fractions))
"""


@pytest.mark.parametrize("most_bytes", [0, 600, 100_000, 1_500_000])
def test_a_full_disk_is_an_error_and_no_crash(most_bytes: int, tmp_path: Path) -> None:
    """HDF5 used to crash when the file was closed, after tracebacks of its own."""
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path / "run.h5"), str(most_bytes)], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "cannot be written (File too large)" in done.stdout
    assert list(tmp_path.iterdir()) == []
    if most_bytes <= 600:
        assert float(done.stdout.split()[-1]) < 0.5, "it is known long before the end"


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
