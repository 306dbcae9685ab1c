"""Damaged files by the hundred: one clear refusal each, or a recording; nothing else ever happens.

The long run: ``SRBVAL_FUZZ=10000 pytest tests/recordings/test_damaged_files.py``.
"""

from __future__ import annotations

import os
import resource
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import pytest

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.registry import FileStatus, add
from srbval.recordings.registry.manifest import home_folder

from .damage import Damage

COUNT = int(os.environ.get("SRBVAL_FUZZ", "360"))
LIMIT_S = 5.0
LIMIT_BYTES = 500 * 2**20
BATCH = 60


def peak_bytes() -> int:
    """Most memory this process has held so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


@pytest.mark.skipif(sys.platform == "win32", reason="peak memory is read as POSIX gives it")
def test_damaged_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("whole", "work", "here"):
        (tmp_path / name).mkdir()
    trap = tmp_path / "executed"
    damage = Damage(tmp_path / "whole", trap)
    monkeypatch.chdir(tmp_path / "here")
    outcomes: Counter[tuple[str, str]] = Counter()
    slowest = 0.0
    for first in range(0, COUNT, BATCH):
        work = tmp_path / "work" / str(first)
        work.mkdir()
        for i in range(first, min(first + BATCH, COUNT)):
            path = work / f"{i}.mat"
            kind = damage.write(i, path)
            before, start = peak_bytes(), time.perf_counter()
            outcomes[kind, _load(path)] += 1
            slowest = max(slowest, time.perf_counter() - start)
            assert peak_bytes() - before < 2 * path.stat().st_size + LIMIT_BYTES, (i, kind)
        made = sorted(p.name for p in work.iterdir())
        registered = add(work)
        assert len(registered.recordings) == len(made)
        assert all(r.status is not FileStatus.MISSING for r in registered.recordings)
        assert sorted(p.name for p in work.iterdir()) == made
        for path in work.iterdir():
            path.unlink()
    assert slowest < LIMIT_S
    assert not trap.exists()
    assert list((tmp_path / "here").iterdir()) == []
    assert sorted(p.name for p in home_folder().iterdir()) == ["manifest.json", "manifest.lock"]
    assert {kind for kind, outcome in outcomes if outcome == "refused"} == {k.__name__ for k in damage.kinds}
    print(f"{COUNT} files, slowest {slowest:.2f} s, peak {peak_bytes() / 2**20:.0f} MB, {dict(outcomes)}")


def _load(path: Path) -> str:
    """``read`` or ``refused``; anything but a recording or a one-line refusal fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            load_recording(path, fs_hz=1000, unit="unknown")
        except DataError as error:
            text = str(error)
            assert text.isprintable(), text
            assert len(text) < 2000, text[:200]
            return "refused"
    return "read"
