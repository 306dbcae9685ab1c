"""Every format times every damage: one clear refusal each, or a recording; nothing else ever happens.

The long run: ``SRBVAL_FUZZ=10000 pytest tests/recordings/test_damage.py``.
"""

import contextlib
import os
import resource
import sys
import threading
import warnings
from collections import Counter
from pathlib import Path

import pytest

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.loaders import limited
from srbval.recordings.registry import FileStatus, add
from srbval.recordings.registry.manifest import home_folder

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


class ReaderMemory(threading.Thread):
    """Looks all the time at the most memory that each process which reads has held (on Linux)."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.most_bytes = 0
        self.over = threading.Event()

    def run(self) -> None:
        while not self.over.wait(0.02):
            for reader in tuple(limited._running):
                with contextlib.suppress(OSError, IndexError):
                    status = Path(f"/proc/{reader.pid}/status").read_text()
                    self.most_bytes = max(self.most_bytes, int(status.split("VmHWM:")[1].split()[0]) * 1024)


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
    readers = ReaderMemory()
    readers.start()
    for first in range(0, COUNT, BATCH):
        work = tmp_path / "work" / str(first)
        work.mkdir()
        for i in range(first, min(first + BATCH, COUNT)):
            path = work / f"{i}.mat"
            cell = damage.write(i, path)
            before, computed = peak_bytes(), computing_s()
            outcome, text = _load(path)
            outcomes[cell[1], outcome] += 1
            deaths.update(death for death in DEATHS if death in text)
            longest = max(longest, computing_s() - computed)
            assert peak_bytes() - before < 2 * path.stat().st_size + LIMIT_BYTES, (i, cell)
            assert readers.most_bytes < LIMIT_BYTES, (i, cell)
            assert longest < HANG_S, (i, cell)
        made = sorted(p.name for p in work.iterdir())
        if first == 0:  # the register takes what comes, and the files stay as they are
            registered = add(work)
            assert len(registered.recordings) + len(registered.left_out) == len(made)
            assert all(r.status is not FileStatus.MISSING for r in registered.recordings)
        assert sorted(p.name for p in work.iterdir()) == made
        for path in work.iterdir():
            path.unlink()
    readers.over.set()
    assert not deaths["could not be read within"]
    assert not trap.exists()
    assert list((tmp_path / "here").iterdir()) == []
    assert sorted(p.name for p in home_folder().iterdir()) == ["manifest.json", "manifest.lock"]
    seen = {damage.cells[i % len(damage.cells)][1].__name__ for i in range(COUNT)}
    assert {kind for kind, outcome in outcomes if outcome == "refused"} == seen
    print(
        f"{COUNT} files, {longest:.2f} s of computing time at most, a reader held {readers.most_bytes / 2**20:.0f} MB"
    )
    print(f"readers ended: {dict(deaths)}; {dict(sorted(outcomes.items()))}")


def _load(path: Path) -> tuple[str, str]:
    """``read`` or ``refused`` and why; anything but a recording or a one-line refusal fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            load_recording(path, fs_hz=1000, unit="unknown")
        except DataError as error:
            text = str(error)
            assert text.isprintable(), text
            assert len(text) < 2000, text[:200]
            return "refused", text
    return "read", ""
