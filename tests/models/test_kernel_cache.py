"""Kernels are compiled in another process, so that every run loads them from the kernel cache."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import srbval
from srbval.models import kernel_cache
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


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[list[str]]:
    """Commands of the processes that would be started; an empty cache."""
    commands: list[list[str]] = []

    @contextlib.contextmanager
    def start(command: list[str], **_: Any) -> Iterator[SimpleNamespace]:
        commands.append(command)
        yield SimpleNamespace(wait=lambda: 0)

    monkeypatch.setattr(kernel_cache.subprocess, "Popen", start)
    monkeypatch.setattr(kernel_cache, "_requested", set())
    monkeypatch.setattr(kernel_cache, "_marker", lambda model: tmp_path / model)
    return commands


def test_a_process_is_asked_once(asked: list[list[str]]) -> None:
    for _ in range(2):
        kernel_cache.precompile("full")
    assert [command[-3:] for command in asked] == [["-m", "srbval.models.precompile", "full"]]


@pytest.mark.parametrize(("jobs", "expected"), [(None, "ssww"), (1, "swsw")])
def test_so_many_are_compiled_at_a_time(
    jobs: int | None, expected: str, asked: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []

    @contextlib.contextmanager
    def start(_: str) -> Iterator[SimpleNamespace]:
        happened.append("s")
        yield SimpleNamespace(wait=lambda: happened.append("w") or 0)

    monkeypatch.setattr(kernel_cache, "_compiler", start)
    kernel_cache.precompile("full", "planar", jobs=jobs)
    assert "".join(happened) == expected
    assert asked == []


def test_what_is_marked_as_compiled_is_not_compiled_again(asked: list[list[str]], tmp_path: Path) -> None:
    (tmp_path / "full").touch()
    kernel_cache.precompile("full")
    assert asked == []


@pytest.mark.parametrize("model", kernel_cache.WITHOUT_KERNELS)
def test_models_without_kernels_need_none(model: str, asked: list[list[str]]) -> None:
    srbval.simulate(srbval.paper_scene(model=model, duration="5 ms", settle="0 s", defect={"kind": "outer"}))
    assert asked == []


def test_a_failed_process_leaves_no_mark(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(kernel_cache, "_requested", set())
    monkeypatch.setattr(kernel_cache, "_marker", lambda model: tmp_path / model)
    kernel_cache.precompile("no-such-model-at-all", "nor-this-one")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_the_compiling_process_ends_with_the_one_that_waits_for_it(tmp_path: Path) -> None:
    """However that ends: nobody would look after it."""
    marker = {"SRBVAL_TEST": str(tmp_path)}
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)} | marker | child_environment()
    code = "from srbval.models.kernel_cache import precompile; precompile('full')"
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


def test_the_compiling_process_takes_this_package_wherever_it_is_started(
    asked: list[list[str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """From within a source tree an installed package would else have the tree's kernels compiled, and not its own."""
    decoy = tmp_path / "srbval"
    decoy.mkdir()
    (decoy / "__init__.py").write_text("")
    kernel_cache.precompile("planar")
    monkeypatch.undo()
    started = asked[0][: asked[0].index("-m")]
    found = subprocess.run(
        [*started, "-c", "import srbval; print(srbval.__file__)"],
        cwd=tmp_path, env=os.environ | child_environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert Path(found.stdout.strip()) == Path(srbval.__file__)
