"""Kernels: compiled by another process, loaded by every run; their bits do not depend on what else is in memory."""

import contextlib
import os
import signal
import struct
import subprocess
import sys
from dataclasses import replace

import pytest
from filelock import FileLock, Timeout

from srbval import paper_scene
from srbval.models import jit, precompile
from srbval.storage.installation import child_environment
from tests.marked import marked, until

ELF, FUNCTION, WEAK = b"\x7fELF\x02\x01", 2, 2
PLANAR_RUN = """
import hashlib, sys, srbval
from srbval.models.jit import compile_in_this_process
from srbval.models.planar import ring_kernel
scene = srbval.paper_scene(model="planar", duration="50 ms", settle="0 s", defect={"kind": "inner"})
if sys.argv[1] == "here":
    compile_in_this_process(scene)
run = srbval.simulate(scene)
misses = sum(sum(f.stats.cache_misses.values()) for f in vars(ring_kernel).values() if hasattr(f, "stats"))
print(hashlib.sha256(run.acceleration_m_s2.tobytes()).hexdigest(), misses)
"""


def functions(machine_code: bytes) -> list[tuple[str, int]]:
    """Names and bindings of the functions that an ELF object defines (System V ABI, chapter 4: sections, symbols)."""
    (table_at,) = struct.unpack_from("<Q", machine_code, 40)
    size, count = struct.unpack_from("<HH", machine_code, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", machine_code, table_at + size * i) for i in range(count)]
    found = []
    for _, kind, _, _, at, length, link, _, _, entry in sections:
        if kind != 2:  # symbols
            continue
        names_at = sections[link][4]
        for place in range(at, at + length, entry):
            name, info, _, section, _, _ = struct.unpack_from("<IBBHQQ", machine_code, place)
            if info & 15 == FUNCTION and section:
                end = machine_code.index(b"\0", names_at + name)
                found.append((machine_code[names_at + name : end].decode(), info >> 4))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="reads ELF objects")
def test_no_kernel_carries_a_copy_of_another():
    """A copy would be weak: the linker takes whichever came into memory first, and they differ in the last digits."""
    jit.precompile(*(paper_scene(model=model) for model in ("full", "line", "planar", "slices")))
    stored = [path.read_bytes() for path in jit.kernel_cache_folder().rglob("*_kernel.*.nbc")]
    codes = [functions(content[content.index(ELF) :]) for content in stored]
    assert len(codes) >= 2
    assert all(codes)
    assert [name for code in codes for name, binding in code if binding == WEAK] == []


def test_a_failed_process_leaves_no_mark(monkeypatch, tmp_path):
    monkeypatch.setattr(jit, "_requested", set())
    monkeypatch.setattr(jit, "_marker", lambda kernel: tmp_path / kernel)
    jit.precompile(replace(paper_scene(), model="no such model"))
    assert list(tmp_path.iterdir()) == []


def test_kernels_of_another_installation_do_not_count(monkeypatch, tmp_path):
    """Numba would not find them: the run itself would have to compile."""
    scene = paper_scene(model="planar")
    jit.precompile(scene)
    assert jit.is_compiled(scene)
    monkeypatch.setattr(jit, "package_folder", lambda: tmp_path)
    assert not jit.is_compiled(scene)


def test_a_part_is_compiled_by_one_process_at_a_time(monkeypatch, tmp_path):
    """Two that rewrite numba's index of one function at once, each for its model, would lose one of both entries."""
    free = []

    def compile_kernel(_: str, part: str, __: int) -> None:
        for other in ("rates", "leapfrog"):
            with contextlib.suppress(Timeout), FileLock(tmp_path / f"{other}.lock", timeout=0):
                free.append((part, other))

    monkeypatch.setattr(precompile, "kernel_cache_folder", lambda: tmp_path)
    monkeypatch.setattr(precompile, "compile_kernel", compile_kernel)
    precompile.compile_kernels(["full-leapfrog-1", "line-rates-2"])
    assert free == [("leapfrog", "rates"), ("rates", "leapfrog")]


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_the_compiling_process_ends_with_the_one_that_waits_for_it(tmp_path):
    """However that ends: nobody would look after it."""
    marker = {"SRBVAL_TEST": str(tmp_path)}
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)} | marker | child_environment()
    code = "import srbval; from srbval.models.jit import precompile; precompile(srbval.paper_scene(), jobs=1)"
    waiting = subprocess.Popen([sys.executable, "-c", code], env=env)
    until(lambda: len(marked(marker)) == 2)
    waiting.kill()
    waiting.wait()
    until(lambda: not marked(marker))
    assert not list(tmp_path.rglob("compiled-full-*"))


def test_a_run_loads_what_a_process_of_its_own_compiled_and_its_bits_are_the_same(tmp_path):
    def run(compiled: str, folder: str) -> list[str]:
        env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / folder)} | child_environment()
        command = [sys.executable, "-P", "-c", PLANAR_RUN, compiled]
        return subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout.split()

    first, second, here = run("apart", "a"), run("apart", "a"), run("here", "b")
    assert first[1] == "0"
    assert first == second
    assert (here[0], here[1] != "0") == (first[0], True)
