"""Damaged and hostile files: each a recording or one clear refusal, never a crash, a hang, or anything executed.

Every format times every damage and claim, seeded; then single claims with what is said of them.
The long run: ``SRBVAL_FUZZ=10000 pytest tests/recordings/test_damage.py``.
"""

import math
import os
import resource
import struct
import sys
import warnings
import zlib
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.load import LeftOpenError
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.loaders.limited import end_readers
from srbval.recordings.registry import FileStatus, add
from srbval.recordings.registry.manifest import home_folder

from . import files
from .damage import Damage

COUNT = int(os.environ.get("SRBVAL_FUZZ", "280"))
HANG_S = 10.0
LIMIT_BYTES = 500 * 2**20
BATCH = 60
DEATHS = ("computing time", "crashed", "ended (", "could not be read within", "bytes of memory")


def peak_bytes() -> int:
    """Most memory this process has held so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def computing_s() -> float:
    """Computing time of this process and of those it has ended; a machine with other work to do adds nothing."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@pytest.mark.skipif(sys.platform == "win32", reason="peak memory is read as POSIX gives it")
@pytest.mark.timeout(max(600, COUNT))
def test_every_format_times_every_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What makes a library loop or crash does so in the process that reads, which is ended and replaced."""
    monkeypatch.setattr(limited, "COMPUTING_S", 2.0)
    monkeypatch.setattr(limited, "WAITING", 100)  # on a busy machine; what hangs without computing fails the test
    for name in ("whole", "work", "here"):
        (tmp_path / name).mkdir()
    trap = tmp_path / "executed"
    damage = Damage(tmp_path / "whole", trap)
    monkeypatch.chdir(tmp_path / "here")
    outcomes: Counter[tuple[str, str]] = Counter()
    deaths: Counter[str] = Counter()
    longest = 0.0
    for first in range(0, COUNT, BATCH):
        end_readers()  # the computing time of a process counts when it ends: of a few files, not of thousands
        work = tmp_path / "work" / str(first)
        work.mkdir()
        for i in range(first, min(first + BATCH, COUNT)):
            path = work / f"{i}.mat"
            cell = damage.write(i, path)
            before, computed = peak_bytes(), computing_s()
            outcome, text = load(path)
            outcomes[cell[1], outcome] += 1
            deaths.update(death for death in DEATHS if death in text)
            longest = max(longest, computing_s() - computed)
            assert peak_bytes() - before < 2 * path.stat().st_size + LIMIT_BYTES, (i, cell)
            assert longest < HANG_S, (i, cell)
        made = sorted(p.name for p in work.iterdir())
        if first == 0:  # the register takes what comes, and the files stay as they are
            registered = add(work)
            assert len(registered.recordings) + len(registered.left_out) == len(made)
            assert all(r.status is not FileStatus.MISSING for r in registered.recordings)
        assert sorted(p.name for p in work.iterdir()) == made
        for path in work.iterdir():
            path.unlink()
    assert not deaths["could not be read within"]
    assert not trap.exists()
    assert list((tmp_path / "here").iterdir()) == []
    assert sorted(p.name for p in home_folder().iterdir()) == ["manifest.json", "manifest.lock"]
    seen = {damage.cells[i % len(damage.cells)][1].__name__ for i in range(COUNT)}
    assert {kind for kind, outcome in outcomes if outcome == "refused"} == seen


def load(path: Path) -> tuple[str, str]:
    """``read`` or ``refused`` and why; anything but a recording or a one-line refusal fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            load_recording(path, fs_hz=1000, unit="unknown")
        except DataError as error:
            text = str(error)
            assert text.isprintable(), text
            assert len(text) < 2000, text[:200]
            return "read" if isinstance(error, LeftOpenError) else "refused", text
    return "read", ""


def refused(path: Path, match: str) -> None:
    with pytest.raises(DataError, match=match) as caught:
        load_recording(path)
    assert "\n" not in str(caught.value)


Write = Callable[[Path], object]
CASES: dict[str, tuple[Write, str]] = {}


def case(match: str) -> Callable[[Write], Write]:
    """Enter what writes a file into the cases, with what is said of the file."""

    def enter(write: Write) -> Write:
        CASES[write.__name__] = write, match
        return write

    return enter


def with_sample(bad: float) -> Write:
    samples = files.vibration()
    samples[1234] = bad
    return lambda path: files.excerpt(path, acc_m_s2=samples)


CASES |= {
    "folder": (lambda path: path.mkdir(), "folder"),
    "missing": (lambda path: path, "no such file"),
    "empty": (lambda path: path.touch(), "empty"),
    "text": (lambda path: path.write_text("this is no recording\nat all\n"), "text file"),
    "one endless line": (lambda path: path.write_text("1," * 2_000_000), "not a table of numbers"),
    "no kind": (lambda path: path.write_bytes(b"XK\x03\x04" + bytes(999)), "not a known recording format. Accepted: "),
    "nan": (with_sample(np.nan), r"acc_m_s2: sample 1234 of 4096 is nan"),
    "inf": (with_sample(-np.inf), r"acc_m_s2: sample 1234 of 4096 is -inf"),
    "no vector": (
        lambda path: savemat(path, {"note": "a", "x": 3.0, "z": files.vibration() * 1j}),
        "without a numeric vector",
    ),
}
if hasattr(os, "mkfifo"):
    CASES["pipe"] = os.mkfifo, "not a regular file"


@case("nested|beyond|MATLAB v5")
def nested_cells(path: Path) -> None:
    value: object = files.vibration()
    for _ in range(200):
        value = files.nested(value)
    savemat(path, {"x": value})


@case("truncated or damaged MATLAB v5 file")
def matlab_numbers_that_do_not_fit(path: Path) -> None:
    savemat(path, {"x": np.ones((700, 3))})
    path.write_bytes(path.read_bytes().replace(struct.pack("<ii", 700, 3), struct.pack("<ii", 699, 3)))


@case("truncated or damaged MATLAB v5 file .*incorrect data check")
def matlab_checksum(path: Path) -> None:
    savemat(path, {"x": files.vibration()}, do_compression=True)
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


@case(r"header claims 4032 values \(float64\) in 32768 bytes")
def npy_with_hidden_samples(path: Path) -> None:
    np.save(path.with_suffix(".npy"), files.vibration())
    path.write_bytes(path.with_suffix(".npy").read_bytes().replace(b"(4096,)", b"(4032,)"))


@case("nested deeper")
def hdf5_circle(path: Path) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("a")
        group["again"] = group


@case("without a numeric vector")
def hdf5_links_out_of_the_file_and_in_circles(path: Path) -> None:
    with h5py.File(path.with_name("secret.h5"), "w") as file:
        file["x"] = files.vibration()
    with h5py.File(path, "w") as file:
        file["loop"], file["out"] = h5py.SoftLink("/"), h5py.ExternalLink("secret.h5", "/x")


def many_links(path: Path, groups: int) -> None:
    with h5py.File(path, "w") as file:
        for i in range(5_000):
            file.require_group(f"g{i % groups}")[f"l{i}"] = h5py.SoftLink("/x")


def huge_claim(path: Path, shape: tuple[int, ...]) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=shape, dtype="f8", chunks=(1024,) * len(shape))


def wide_chunk(path: Path) -> None:
    """A few bytes of a compressed chunk that claims to expand to two gigabytes."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("x", (4000,), "f8", chunks=(2**28,), maxshape=(None,), compression="gzip")
        data.id.write_direct_chunk((0,), zlib.compress(bytes(2**20)))


def filters(path: Path, numbers: tuple[int, ...]) -> None:
    with h5py.File(path, "w") as file:
        settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        settings.set_chunk((4096,))
        for number in numbers:
            settings.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (9,) if number == 1 else ())
        data = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((4096,)), settings)
        data.write_direct_chunk((0,), files.vibration().tobytes(), 0)
        file.attrs["fs_hz"] = 1000.0


def half_written(path: Path, name: str, **attributes: object) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset(name, (4000,), "f8", chunks=(1000,))[:1000] = files.vibration(1000)
        file.attrs.update({"fs_hz": 1000.0, "unit": "m/s2"} | attributes)


MANY = "[0-9]{4} or more links, references and attributes; 4096 are read at most"
UNWRITTEN = r"3 of 4 chunks of '{}' were never written \(75 % of its samples\); copy"
CASES |= {f"{groups} groups of links": (partial(many_links, groups=groups), MANY) for groups in (1, 5)}
CASES |= {
    f"claim {shape}": (partial(huge_claim, shape=shape), f"claims {8 * math.prod(shape)} bytes")
    for shape in ((10**12,), (2**32, 2**32), (2**62,))
}
CASES |= {
    "wide chunk": (wide_chunk, "a chunk of dataset 'x' claims 2147483648 bytes"),
    "unknown filter": (partial(filters, numbers=(32768,)), "filter 32768, not installed. Decompress: h5repack"),
    "eight filters": (partial(filters, numbers=(1,) * 8), "compressed by 8 filters"),
    "half": (partial(half_written, name="x"), UNWRITTEN.format("x")),
    "half of a stand-in": (
        partial(half_written, name="acceleration_m_s2", srbval_kind="stand-in"),
        UNWRITTEN.format("acceleration_m_s2"),
    ),
}


@case(r"4 of 8 chunks of 'Signal_3\.y_values\.values' were never written \(50 %")
def half_a_struct(path: Path) -> None:
    files.rig_v73(path, files.rig_signals())
    with h5py.File(path, "r+") as file:
        shape = file[file["Signal_3/y_values/values"][0, 0]].shape
        empty = file["#refs#"].create_dataset("half", shape, "f8", chunks=(1, shape[1] // 2))
        empty[:, : shape[1] // 2] = 1.0
        file["Signal_3/y_values/values"][0, 0] = empty.ref


@pytest.mark.parametrize(("write", "match"), CASES.values(), ids=CASES.keys())
def test_refused_and_said_why(tmp_path: Path, write: Write, match: str) -> None:
    write(tmp_path / "H_727rpm_124.8kN_0kN.mat")
    refused(tmp_path / "H_727rpm_124.8kN_0kN.mat", match)


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
        file["x"], file.attrs["fs_hz"] = files.vibration(), 1000.0
        scale = "This is a netCDF dimension but not a netCDF variable.      4096"
        file.create_dataset("sample", (4096,), ">f4").make_scale(scale)
        file["x"].dims[0].attach_scale(file["sample"])
    assert load_recording(tmp_path / "a.nc", unit="g").channel == "x"


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
    refused(tmp_path / "a.h5", MANY)
