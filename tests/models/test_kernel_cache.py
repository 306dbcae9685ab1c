"""Kernels are compiled in another process, so that every run loads them from the kernel cache."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from srbval.models import jit
from srbval.storage.installation import child_environment
from tests.marked import marked, until

SHORT_PLANAR = "srbval.paper_scene(model='planar', duration='5 ms', settle='0 s', defect={'kind': 'outer'})"
REPORT = f"""
import hashlib, srbval
from srbval.models.planar import ring_kernel
run = srbval.simulate({SHORT_PLANAR})
misses = sum(sum(f.stats.cache_misses.values()) for f in vars(ring_kernel).values() if hasattr(f, "stats"))
print(hashlib.sha256(run.acceleration_m_s2.tobytes()).hexdigest(), misses)
"""


def test_a_failed_process_leaves_no_mark(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(jit, "_requested", set())
    monkeypatch.setattr(jit, "_marker", lambda model: tmp_path / model)
    jit.precompile("no-such-model-at-all", "nor-this-one")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_the_compiling_process_ends_with_the_one_that_waits_for_it(tmp_path: Path) -> None:
    """However that ends: nobody would look after it."""
    marker = {"SRBVAL_TEST": str(tmp_path)}
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)} | marker | child_environment()
    code = "from srbval.models.jit import precompile; precompile('full')"
    waiting = subprocess.Popen([sys.executable, "-c", code], env=env)
    until(lambda: len(marked(marker)) == 2)
    waiting.kill()
    waiting.wait()
    until(lambda: not marked(marker))
    assert not list(tmp_path.rglob("compiled-full-*"))


def test_the_first_process_loads_what_another_compiled(tmp_path: Path) -> None:
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)} | child_environment()
    first, second = (
        subprocess.run([sys.executable, "-c", REPORT], env=env, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert first.split()[1] == "0"
    assert first == second
