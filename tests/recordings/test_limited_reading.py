"""Files that make a library hang, crash or take all memory: the process that reads them ends, nothing else does."""

import os
import runpy
import signal
import sys
import threading

import h5py
import pytest

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.loaders import limited
from srbval.recordings.loaders.limited import FileFormat, end_readers
from srbval.recordings.manifest import FileStatus, read_manifest
from srbval.recordings.registry import add
from tests.marked import until

from . import files

posix = pytest.mark.skipif(sys.platform == "win32", reason="limits as POSIX has them")
linux = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux")


def good(path):
    with h5py.File(path, "w") as file:
        file["x"], file["name"] = files.vibration(), "hello"
        file.attrs["fs_hz"] = 1000.0
    return path


def hanging(path):
    """A file whose first text of variable length lies in a heap object of no size: HDF5 1.14 and 2.0 never return."""
    damaged = bytearray(good(path).read_bytes())
    damaged[damaged.find(b"GCOL") + 24] = 0
    path.write_bytes(damaged)


@pytest.fixture(autouse=True)
def _own_readers(monkeypatch):
    """New ones for each test, which may wait for long on a busy machine."""
    end_readers()
    monkeypatch.setattr(limited, "WAITING", 200)


def test_one_that_hangs_does_not_stop_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(limited, "COMPUTING_S", 0.5)
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
    """Let a reader do what a damaged file would make it do."""

    def read(text):
        path = tmp_path / "does.py"
        path.write_text(f"import ctypes, mmap, os, signal, time\n{text}\n")
        FileFormat(name="x", description="x", matches=bool, read=runpy.run_path).load(path)

    return read


@posix
@pytest.mark.parametrize(
    ("does", "match"),
    [
        ("while True: pass", "more than 1 s of computing time"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"crashed \(signal SIGSEGV\)\. The file is damaged; copy it again"),
        ("os.kill(os.getpid(), signal.SIGKILL)", r"ended \(signal SIGKILL\), perhaps for lack of memory"),
        ("os._exit(7)", r"ended \(exit code 7\)"),
        ("open('/none')", "cannot be read"),
        ("time.sleep(1000)", r"could not be read within 2\.0 s"),
        pytest.param("[bytearray(10**8) for _ in range(20)]", r"more than \d+ bytes of memory", marks=linux),
    ],
)
def test_how_it_ended_is_said(run, does, match, tmp_path, monkeypatch, capfd):
    """Nothing else is printed, and no memory is dumped into the folder."""
    monkeypatch.setattr(limited, "COMPUTING_S", 0.5)
    monkeypatch.setattr(limited, "WAITING", 2.0 if "within" in match else 200)
    with pytest.raises(DataError, match=match) as caught:
        run(does)
    assert str(caught.value).startswith(str(tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == ["does.py"]
    assert capfd.readouterr() == ("", "")


@posix
def test_a_process_that_died_while_idle_is_replaced(tmp_path):
    load_recording(good(tmp_path / "a.h5"), unit="g")
    os.kill(limited._idle[0].start().pid, signal.SIGKILL)
    assert load_recording(tmp_path / "a.h5", unit="g").samples == 4096


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
    assert limited._idle == []


@posix
def test_ctrl_c_does_not_wait_for_files_that_hang(tmp_path):
    """Readers of other threads end too, and the files still to come are not begun."""
    for i in range(4):
        hanging(tmp_path / f"{i}.h5")
    before = os.times()
    threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        add(tmp_path)
    after = os.times()
    assert after.children_user + after.children_system - before.children_user - before.children_system < 6
    assert not limited._running
    assert not read_manifest()
