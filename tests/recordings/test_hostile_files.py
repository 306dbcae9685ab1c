"""Damaged and hostile files give a recording or one clear error, never a crash or a hang, and execute nothing.

First every format with seeded random damage, then single defects with their messages, then names with control
characters or markup, then files with which a library hangs, crashes or exhausts the memory: only the child process that
reads them ends. Long run: ``SRBVAL_FUZZ=10000 pytest tests/recordings/test_hostile_files.py``.
"""

import contextlib
import io
import itertools
import json
import os
import pickle
import runpy
import signal
import struct
import sys
import threading
import warnings
import zlib
from collections import Counter
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.processes import worker
from srbval.recordings import load_recording, loaders
from srbval.recordings.loaders import FileFormat, end_readers
from srbval.recordings.manifest import FileStatus, read_manifest
from srbval.recordings.registry import add
from tests.marked import until
from tests.recordings.synthetic_record import write_synthetic_record

from . import files, formats

COUNT = int(os.environ.get("SRBVAL_FUZZ", "100"))  # each format with each damage at least once
HANG_S = 10.0
LIMIT_BYTES = 500 * 2**20
BATCH = 50
SCRIPT = "<script>alert('\"1\"')</script>"
HOSTILE = ["", "\x00", "\x1b[2J\x1b]0;owned\x07", "a\nb\r\nc", "../../etc/passwd", "$(touch owned)", "' OR 1=1; --"]
HOSTILE += ["{{7*7}}{0.__class__}", "%s%n", "\u202egnp.x\ufeff", "é" * 5000, "A" * 70_000, "nan", "1e999", SCRIPT]


class Trap:
    """Creates a folder if it is unpickled, which must never happen."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


def cut(rng, whole):
    return whole[: int(rng.integers(len(whole)))]


def changed(rng, whole):
    """Flip bits, or replace sizes, counts, types, addresses and longer pieces by other values, zeros or noise."""
    data = bytearray(whole)
    for _ in range(int(rng.integers(1, 8))):
        width = int(rng.choice((1, 2, 4, 8, 8, 100)))
        reach = int(rng.choice((64, 400, 4000, 10**9)))  # most of what matters is at the beginning
        at = int(rng.integers(max(1, min(len(data) - width, reach))))
        most, old = 256**width - 1, int.from_bytes(data[at : at + width], "little")
        flip = old ^ 1 << int(rng.integers(8 * width))
        new = [flip, 0, 1, most, most // 2, old + 1, old - 1, 2 * old, len(data), at, int.from_bytes(rng.bytes(width))]
        data[at : at + width] = (new[int(rng.integers(len(new)))] & most).to_bytes(width, "little")
    return bytes(data)


def pickled(rng, folder):
    """A pickle that creates the folder, or a NumPy array of such objects."""
    if rng.random() < 0.5:
        return pickle.dumps(Trap(folder), protocol=int(rng.integers(0, 6)))
    stream = io.BytesIO()
    np.save(stream, np.array([Trap(folder)] * 2, dtype=object), allow_pickle=True)
    return stream.getvalue()


def whole_files(folder):
    """Write an intact file of every format."""
    found = {}
    for kind in formats.WRITERS:
        with contextlib.suppress(pytest.skip.Exception):
            found[kind] = formats.whole(kind)
    write_synthetic_record(folder / "own.h5", state=Fault.OUTER, shaft_hz=10, seconds=0.2, seed=1)
    files.excerpt(folder / "OR_877rpm.mat")
    files.rig_v5(folder / "IR_727rpm_124.8kN_0kN.mat", files.rig_signals())
    with contextlib.suppress(pytest.skip.Exception):
        files.rig_v73(folder / "H_727rpm_124.8kN_0kN.mat", files.rig_signals())
    return found | {path.name: path.read_bytes() for path in folder.iterdir()}


def used():
    """Peak memory [bytes] and computing time [s] of this process and its ended children.

    The numbers do not depend on the load of the machine.
    """
    import resource  # of POSIX

    own, ended = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    peak = own.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    return peak, sum(one.ru_utime + one.ru_stime for one in (own, ended))


@pytest.mark.skipif(sys.platform == "win32", reason="peak memory is read as POSIX gives it")
@pytest.mark.timeout(max(600, COUNT))
def test_every_format_with_every_damage(tmp_path, monkeypatch):
    """A library that loops or crashes affects only its child process, which is ended and replaced."""
    monkeypatch.setattr(loaders, "COMPUTING_S", 2.0)
    monkeypatch.setattr(loaders, "WAITING", 100)  # on a busy machine; what hangs without computing fails the test
    for name in ("whole", "work", "here"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    trap = tmp_path / "executed"
    whole, damages = whole_files(tmp_path / "whole"), (cut, changed, changed, changed)
    cells = [*itertools.product(whole, damages), *[("", pickled)] * 6]
    outcomes = Counter()
    for i in range(COUNT):
        if i % BATCH == 0:
            end_readers()  # the computing time of a process counts when it ends: of some files, not of thousands
        path, rng = tmp_path / "work" / f"{i}.mat", np.random.default_rng((20260101, i))
        name, damage = cells[i * 7919 % len(cells)]
        path.write_bytes(damage(rng, whole[name] if name else trap))
        peak, computed = used()
        outcomes[damage, load(path)] += 1
        more, longer = used()[0] - peak, used()[1] - computed
        assert more < 2 * path.stat().st_size + LIMIT_BYTES, (i, name, damage)
        assert longer < HANG_S, (i, name, damage)
    registered = add(tmp_path / "work")
    assert len(registered.recordings) + len(registered.left_out) == len(list((tmp_path / "work").iterdir())) == COUNT
    assert not trap.exists()
    assert list((tmp_path / "here").iterdir()) == []
    assert {damage for damage, outcome in outcomes if outcome == "refused"} == {cut, changed, pickled}


def load(path):
    """Load a file; returns ``read`` or ``refused``, and fails unless the error is one line."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            load_recording(path, fs_hz=1000, unit="unknown")
        except DataError as error:
            text = str(error)
            assert text.isprintable(), text
            assert len(text) < 2000, text[:200]
            assert "could not be read within" not in text
            return "read" if error.questions else "refused"
    return "read"


def refused(path, match):
    with pytest.raises(DataError, match=match) as caught:
        load_recording(path)
    assert (str(caught.value).startswith(str(path)), "\n" in str(caught.value)) == (True, False)


def nan(path):
    samples = files.vibration()
    samples[1234] = np.nan
    files.excerpt(path, acc_m_s2=samples)


def nested_cells(path):
    value = files.vibration()
    for _ in range(200):
        value = files.nested(value)
    savemat(path, {"x": value})


def matlab_numbers_that_do_not_fit(path):
    savemat(path, {"x": np.ones((700, 3))})
    path.write_bytes(path.read_bytes().replace(struct.pack("<ii", 700, 3), struct.pack("<ii", 699, 3)))


def matlab_checksum(path):
    savemat(path, {"x": files.vibration()}, do_compression=True)
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def npy(path, shape):
    np.save(path.with_suffix(".npy"), files.vibration())
    header = b"(4096,), }".ljust(50)
    path.write_bytes(path.with_suffix(".npy").read_bytes().replace(header, f"{shape}, }}".encode().ljust(50)))


def hdf5(make):
    """Create a writer of HDF5 files whose content `make` writes."""

    def write(path):
        with h5py.File(path, "w") as file:
            make(file)

    return write


def circle(file):
    group = file.create_group("a")
    group["again"] = group


def links_out_of_the_file_and_in_circles(file):
    with h5py.File(Path(file.filename).with_name("secret.h5"), "w") as other:
        other["x"] = files.vibration()
    file["loop"], file["out"] = h5py.SoftLink("/"), h5py.ExternalLink("secret.h5", "/x")


def many_links(file):
    for i in range(5_000):
        file.require_group("g")[f"l{i}"] = h5py.SoftLink("/x")


def huge_claim(file, shape):
    file.create_dataset("x", shape=shape, dtype="f8", chunks=(1024,) * len(shape))


def wide_chunk(file):
    """Write a compressed chunk of two megabytes that expands to half a gigabyte."""
    data = file.create_dataset("x", (4000,), "f8", chunks=(2**26,), maxshape=(None,), compression="gzip")
    data.id.write_direct_chunk((0,), zlib.compress(bytes(2**29), 1))


def filters(file, numbers):
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((4096,))
    for number in numbers:
        settings.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (9,) if number == 1 else ())
    data = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((4096,)), settings)
    data.write_direct_chunk((0,), files.vibration().tobytes(), 0)
    file.attrs["fs_hz"] = 1000.0


def half_written(file):
    file.create_dataset("x", (4000,), "f8", chunks=(1000,))[:1000] = files.vibration(1000)
    file.attrs.update({"fs_hz": 1000.0, "unit": "m/s2"})


MEMORY = r"more than \d+ bytes of memory|truncated or damaged"
UNWRITTEN = r"{} chunks of '{}' were never written \({} % of its samples\)"
CASES = {
    "folder": (Path.mkdir, "folder"),
    "missing": (str, "no such file"),
    "empty": (Path.touch, "the file is empty"),
    "text": (lambda path: path.write_text("this is no recording\nat all\n"), "text file"),
    "one endless line": (lambda path: path.write_text("x," * 200_000), "not a table of numbers"),
    "no kind": (lambda path: path.write_bytes(b"XK\x03\x04" + bytes(999)), "not a known recording format. Accepted: "),
    "pipe": (os.mkfifo, "not a regular file"),
    "nan": (nan, r"acc_m_s2: sample 1234 of 4096 is nan"),
    "no vector": (lambda path: savemat(path, {"x": 3.0, "z": files.vibration() * 1j}), "without a numeric vector"),
    "nested cells": (nested_cells, "more than .* nested levels|MATLAB v5"),
    "numbers that do not fit": (matlab_numbers_that_do_not_fit, r"truncated or damaged \(MATLAB v5: "),
    "checksum": (matlab_checksum, r"truncated or damaged \(MATLAB v5: .*incorrect data check"),
    "hidden samples": (partial(npy, shape="(4032,)"), r"header claims 4032 values \(float64\) in 32768 bytes"),
    "claim in NumPy's header": (partial(npy, shape=f"({2**61 + 4096},)"), r"truncated or unusable \.npy"),
    "circle": (hdf5(circle), "without a numeric vector"),
    "links": (hdf5(links_out_of_the_file_and_in_circles), "without a numeric vector"),
    "links in a group": (hdf5(many_links), "without a numeric vector"),
    "wide chunk": (hdf5(wide_chunk), MEMORY),
    "unknown filter": (hdf5(partial(filters, numbers=(32768,))), "filter 32768, not installed. Decompress: h5repack"),
    "half": (hdf5(half_written), UNWRITTEN.format("3 of 4", "x", 75) + "; copy"),
} | {
    f"claim {shape}": (hdf5(partial(huge_claim, shape=shape)), MEMORY)
    for shape in ((10**12,), (2**32, 2**32), (2**62,))
}


@pytest.mark.parametrize(("write", "match"), CASES.values(), ids=CASES.keys())
def test_refused_with_the_reason(tmp_path, write, match):
    write(tmp_path / "H_727rpm_124.8kN_0kN.mat")
    refused(tmp_path / "H_727rpm_124.8kN_0kN.mat", match)


@pytest.mark.parametrize("used", ["x", "time", "fs", "spare"])
def test_hdf5_datasets_never_written(tmp_path, used):
    """An unwritten dataset is refused as a signal, a time or a number, but not as an unused text."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        if used != "x":
            file["x"] = files.vibration()
        file.create_dataset(used, {"fs": (), "spare": (9,)}.get(used, (4096,)), "f8")
        file.attrs["fs_hz" if used != "time" else "note"] = 1000.0
    if used == "spare":
        assert load_recording(tmp_path / "a.h5", unit="g").samples == 4096
    else:
        refused(tmp_path / "a.h5", UNWRITTEN.format("1 of 1", used, 100))


def test_dimension_without_values(tmp_path):
    """netCDF-4 stores a dimension without coordinates as an unwritten dataset; neither it nor a type is a variable."""
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["x"], file.attrs["fs_hz"], file["type"] = files.vibration(), 1000.0, np.dtype("f8")
        scale = "This is a netCDF dimension but not a netCDF variable.      4096"
        file.create_dataset("sample", (4096,), ">f4").make_scale(scale)
        file["x"].dims[0].attach_scale(file["sample"])
    assert load_recording(tmp_path / "a.nc", unit="g").channel == "x"


def test_hostile_names_within_files_are_shown_as_plain_text(tmp_path, srbval_text):
    for i, hostile in enumerate(text.replace("\0", "") or "x" for text in HOSTILE):
        with h5py.File(tmp_path / f"{i}.h5", "w") as file:
            file.attrs["fs_hz"], file.attrs["unit"], file.attrs["rpm"] = 8000.0, "g", 1200.0
            file.attrs["name"] = file.attrs["label"] = hostile[:10_000]
            file[hostile[:10_000].replace("/", "_").replace(".", "_")] = files.vibration()
        channel = load_recording(tmp_path / f"{i}.h5").channel or ""
        assert channel.isprintable()
        assert 0 < len(channel) <= 80
    assert {entry.status for entry in add(tmp_path).recordings} == {FileStatus.OK}
    given = ["--bearing", "skf-6205", "--band", "500", "3000"]
    analysed = [["analyse", tmp_path / f"{i}.h5", *given] for i in (2, len(HOSTILE) - 1)]  # control characters; markup
    for words in (["data", "list"], ["data", "list", "--json"], *analysed):
        assert "\x1b" not in "".join(srbval_text(*words))
    facts = {"name": SCRIPT + "b" * 10_000, "origin": "simulated", "fs_hz": 8000.0, "unit": "m/s2", "channel": "x"}
    facts |= {"bearing": "../../../secret.toml", "notes": ["\x1b[2J"]}  # a path leads nowhere
    for kind, name in (("run", "acceleration_x_m_s2"), ("recording", "x")):
        with h5py.File(tmp_path / "own.h5", "w") as file:
            file.attrs.update({"srbval_kind": kind, "fs_hz": 8000.0, "facts": json.dumps(facts)})
            file[name] = files.vibration()
        own = load_recording(tmp_path / "own.h5")
        assert (own.bearing, len(own.name) <= 80, own.notes) == (None, True, ("?[2J",))


posix = pytest.mark.skipif(sys.platform == "win32", reason="limits as POSIX has them")
linux = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux")


def good(path):
    with h5py.File(path, "w") as file:
        file["x"], file["name"] = files.vibration(), "hello"
        file.attrs["fs_hz"] = 1000.0
    return path


def hanging(path):
    """Write a file whose text is in a heap object without a size, in which HDF5 1.14 and 2.0 loop for ever."""
    damaged = bytearray(good(path).read_bytes())
    damaged[damaged.find(b"GCOL") + 24] = 0
    path.write_bytes(damaged)


@pytest.fixture
def _own_readers(monkeypatch):
    """Start new reader processes for each test; they may need long on a busy machine."""
    end_readers()
    monkeypatch.setattr(worker, "is_single_threaded", lambda: False)
    monkeypatch.setattr(loaders, "WAITING", 200)


@pytest.mark.usefixtures("_own_readers")
def test_one_that_hangs_does_not_stop_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(loaders, "COMPUTING_S", 0.5)
    hanging(tmp_path / "bad.h5")
    for i in range(3):
        good(tmp_path / f"good{i}.h5")
    bad, *others = add(tmp_path).recordings
    assert [entry.status for entry in others] == [FileStatus.OK] * 3
    assert bad.status is FileStatus.UNREADABLE
    assert "took more than 1 s of computing time. The file is damaged; copy it again" in (bad.reason or "")
    assert load_recording(tmp_path / "good1.h5", unit="g").samples == 4096


@pytest.fixture
def run(tmp_path):
    """Let a reader process execute a function, as a damaged file could make it do."""

    def read(text):
        path = tmp_path / "does.py"
        path.write_text(f"import ctypes, mmap, os, signal, time\n{text}\n")
        FileFormat(name="x", description="x", mark=b"", read=runpy.run_path).load(path)

    return read


@pytest.mark.usefixtures("_own_readers")
@posix
@pytest.mark.parametrize(
    ("does", "match"),
    [
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"ended \(signal SIGSEGV\)\. Copy the file again"),
        ("os._exit(7)", r"ended \(exit code 7\)"),
        ("open('/none')", "cannot be read"),
        ("time.sleep(1000)", r"could not be read within 0\.5 s"),
        pytest.param("[bytearray(10**8) for _ in range(20)]", r"more than \d+ bytes of memory", marks=linux),
    ],
)
def test_how_it_ended_is_said(run, does, match, tmp_path, monkeypatch, capfd):
    """The error is the only output, and no memory dump is written; the end of a loop is said above."""
    monkeypatch.setattr(loaders, "COMPUTING_S", 0.5)
    monkeypatch.setattr(loaders, "WAITING", 0.5 if "within" in match else 200)
    with pytest.raises(DataError, match=match) as caught:
        run(does)
    assert str(caught.value).startswith(str(tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == ["does.py"]
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("_own_readers")
@posix
def test_a_process_that_died_while_idle_is_replaced(tmp_path):
    load_recording(good(tmp_path / "a.h5"), unit="g")
    os.kill(loaders._idle[0].start().pid, signal.SIGKILL)
    assert load_recording(tmp_path / "a.h5", unit="g").samples == 4096


@pytest.mark.usefixtures("_own_readers")
@posix
def test_ctrl_c_ends_the_reader(run, tmp_path):
    noted = tmp_path / "pid"

    def interrupt():
        until(lambda: noted.exists() and noted.read_text())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run(f"open({str(noted)!r}, 'w').write(str(os.getpid()))\ntime.sleep(1000)")
    thread.join()
    with pytest.raises(ProcessLookupError):
        os.kill(int(noted.read_text()), 0)
    assert loaders._idle == []


@pytest.mark.usefixtures("_own_readers")
@posix
def test_ctrl_c_does_not_wait_for_files_that_hang(tmp_path):
    """Readers of other threads end too, and files still to be read are not started."""
    for i in range(4):
        hanging(tmp_path / f"{i}.h5")
    before = os.times()
    threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        add(tmp_path)
    after = os.times()
    assert after.children_user + after.children_system - before.children_user - before.children_system < 6
    assert not loaders._running
    assert not read_manifest()
