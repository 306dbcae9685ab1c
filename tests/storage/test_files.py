"""Files: whole or left as they were, with a checksum, found where the package is; what it holds becomes strict JSON."""

import contextlib
import enum
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import h5py
import numpy as np
import pytest

from srbval import DataError, load_recording
from srbval.bearing import Fault
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.hdf5_files import FOOTER_BYTES, append_checksum, checked_summary
from srbval.storage.json_files import json_text, parse_json, to_json
from tests.recordings.synthetic_record import write_synthetic_record


def test_the_old_file_is_there_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "x" / "y" / "a.txt"
    with atomic_write(path) as part:  # which makes the folders
        part.write_text("old")
    with atomic_write(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
        assert part.parent == path.parent  # the same file system, so that renaming is atomic
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("name", ["pipe", "pipe/b.txt", "a\0b", "\ud800"])
def test_what_no_file_can_replace_stays(name, tmp_path):
    """A pipe stands for the devices in /dev, which root could replace, to the harm of every program."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DataError), atomic_write(tmp_path / name) as part:
        part.touch()
    assert [path.is_fifo() for path in tmp_path.iterdir()] == [True]


def test_only_what_this_program_left_unfinished_is_removed(tmp_path):
    own = tmp_path / ".a.txt.x0_yz9ab.srbval-part"
    kept = [".a.txt.x.part", ".b.txt.x0_yz9ab.srbval-part", ".x.part", "a.txt", ".a.txt.srbval-part"]
    for name in (own.name, *kept):
        (tmp_path / name).write_text("x")
    (tmp_path / ".a.txt.aaaaaaaa.srbval-part").mkdir()
    (tmp_path / ".a.txt.bbbbbbbb.srbval-part").symlink_to(own)
    remove_unfinished(tmp_path, "a.txt".__eq__)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {*kept, ".a.txt.aaaaaaaa.srbval-part", ".a.txt.bbbbbbbb.srbval-part"}


FULL = """
import resource, signal, sys
from pathlib import Path
from srbval import DataError, paper_scene
from srbval.models.simulate import simulate_to_file

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
fractions = []
scene = paper_scene(model="kinematic", duration_s=2.0, defect={"kind": "outer"})
try:
    simulate_to_file(scene, Path(sys.argv[1]), progress=lambda _, fraction: fractions.append(fraction))
except DataError as error:
    print(error, max(fractions))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a limit on files is of POSIX")
@pytest.mark.parametrize("most_bytes", [600, 1_500_000])
def test_a_full_disk_is_an_error_and_no_crash(most_bytes, tmp_path):
    """HDF5 used to crash when the file was closed, after tracebacks of its own."""
    command = [sys.executable, "-c", FULL, str(tmp_path / "run.h5"), str(most_bytes)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "cannot be written (File too large)" in done.stdout
    assert list(tmp_path.iterdir()) == []
    if most_bytes <= 600:
        assert float(done.stdout.split()[-1]) < 0.5, "it is known long before the end"


def test_every_byte_counts(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"content" * 3)
    assert checked_summary(path) is None
    append_checksum(path, b"summary\n")
    assert checked_summary(path) == b"summary\n"
    whole = path.read_bytes()
    for at in range(0, 8 * len(whole), 7):  # every byte, and every place within one
        raw = bytearray(whole)
        raw[at // 8] ^= 1 << at % 8
        path.write_bytes(raw)
        with contextlib.suppress(DataError):
            assert checked_summary(path) is None  # the mark itself is hit
            assert at // 8 >= len(whole) - FOOTER_BYTES
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        assert checked_summary(path) is None


def test_own_recordings_are_refused_when_a_bit_has_flipped(tmp_path):
    """A file without a checksum is read."""
    path = tmp_path / "s.h5"
    write_synthetic_record(path, state=Fault.OUTER, shaft_hz=14.3, seconds=0.5, seed=1)
    whole, before = path.read_bytes(), load_recording(path)
    damaged = whole[:5000] + bytes([whole[5000] ^ 4]) + whole[5001:]
    for content, said in ((damaged, "damaged"), (whole[:-1], "no checksum at its end")):
        path.write_bytes(content)
        with pytest.raises(DataError, match=said):
            load_recording(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        del file.attrs["srbval_checksum"]
    after = load_recording(path)
    np.testing.assert_array_equal(before.channels["signal"], after.channels["signal"])


class Code(enum.Enum):
    ONE = 1
    NOTHING = float("nan")


class Point(NamedTuple):
    x: float
    y: float


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.bool_(True), True),
        (np.str_("text"), "text"),
        (float("nan"), None),
        (-np.inf, None),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        (Point(1.0, 2.0), [1.0, 2.0]),
        (Path("a/b"), "a/b"),
        (datetime(2026, 1, 2, tzinfo=UTC), "2026-01-02T00:00:00+00:00"),
        (Fault.OUTER, "outer"),
        (Code.NOTHING, None),
        ({Fault.OUTER: 1}, {"outer": 1}),
        (MappingProxyType({"b": 1, "a": (2,)}), {"b": 1, "a": [2]}),
        ({"unit": "µm"}, {"unit": "µm"}),
    ],
    ids=repr,
)
def test_values_become_plain_json(value, expected):
    assert parse_json(json_text(value)) == expected
    assert type(to_json(value)) in (str, int, float, bool, list, dict, type(None))
