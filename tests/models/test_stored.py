"""Stored kernels and runs: bit for bit what they were, and read until something that they follow from changes."""

import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from llvmlite.binding import ObjectFileRef

from srbval import Run, load_scene, paper_scene
from srbval.models import jit
from srbval.models.simulate import RUNS, Step, run_content, stored_run, stored_summary
from srbval.storage.installation import child_environment, package_folder
from tests.marked import marked, until

ELF, FUNCTION, WEAK = b"\x7fELF\x02\x01", 2, 2
PLANAR_RUN = """
import hashlib, sys, srbval
from srbval.models import jit
from srbval.models.jit import compile_in_this_process
scene = srbval.paper_scene(model="planar", duration="50 ms", settle="0 s", defect={"kind": "inner"})
if sys.argv[1] == "here":
    compile_in_this_process(scene)
compiler, started = jit._start_compiler, []
jit._start_compiler = lambda kernels: started.append(kernels) or compiler(kernels)
run = srbval.simulate(scene)
print(hashlib.sha256(run.acceleration_m_s2.tobytes()).hexdigest(), int("numba" in sys.modules), len(started))
"""


def bindings(machine_code: bytes) -> dict[str, int]:
    """Bindings by name of the functions that an ELF object defines (System V ABI, chapter 4: symbols)."""
    parts = ObjectFileRef.from_data(machine_code).sections()
    sections = {one.name(): one.data() for one in parts if one.name() in (b".symtab", b".strtab")}
    names, found = sections[b".strtab"], {}
    for name, info, _, section, _, _ in struct.iter_unpack("<IBBHQQ", sections[b".symtab"]):
        if info & 15 == FUNCTION and section:
            found[names[name : names.index(b"\0", name)].decode()] = info >> 4
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="reads ELF objects")
def test_no_kernel_carries_a_copy_of_another():
    """A copy would be weak: the linker takes whichever came into memory first, and they differ in the last digits."""
    jit.precompile(paper_scene(), paper_scene(model="planar"), load_scene("rig"))
    stored = [path.read_bytes() for path in jit.kernel_cache_folder().glob("*.kernel")]
    codes = [bindings(content[content.index(ELF) :]) for content in stored]
    assert len(codes) >= 2
    assert all(codes)
    assert [name for code in codes for name, binding in code.items() if binding == WEAK] == []


def sum_of_squares(values, out):
    """A kernel that is compiled in no time."""
    for value in values:
        out[0] += value * value


def flip(content: bytes, place: float) -> bytes:
    """Content with one bit changed, `place` of the way through it."""
    at = int(place * len(content))
    return content[:at] + bytes([content[at] ^ 1 << int(8 * place)]) + content[at + 1 :]


DAMAGE = {  # of a file: how it is changed, given a share of its length, and the same file of another version
    "flipped": lambda file, place, _: file.write_bytes(flip(file.read_bytes(), place)),
    "cut": lambda file, place, _: file.write_bytes(file.read_bytes()[: int(place * file.stat().st_size)]),
    "deleted": lambda file, _, __: file.unlink(),
    "of another version": lambda file, _, other: shutil.copyfile(other / file.name, file),
}


@pytest.mark.parametrize("number", [2, pytest.param(50, marks=pytest.mark.long_form)])
@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_kernels_are_compiled_again(number, kind, monkeypatch, tmp_path, capsys):
    """Loaded as they are, they would end the process: machine code has no checksum of its own."""

    compilations = []
    compiler = jit.compile_function
    monkeypatch.setattr(jit, "compile_function", lambda *of: compilations.append(of) or compiler(*of))

    def compiled() -> int:
        """Times that the kernel was compiled, with the right answer."""
        before, out = len(compilations), np.zeros(1)
        jit.kernel(sum_of_squares)(np.arange(4.0), out)
        assert out[0] == 14.0
        return len(compilations) - before

    for version in ("other", "this"):
        monkeypatch.setattr(jit, "kernel_cache_folder", lambda version=version: tmp_path / version)
        jit.compile_and_list("tiny", compiled)
    (file,) = (tmp_path / "this").glob("*.kernel")
    for place in np.random.default_rng(number).uniform(size=number):
        jit._cached_kernels.clear()
        assert jit._is_stored("tiny")
        assert compiled() == 0
        damaged = file if kind == "of another version" or place < 0.8 else jit._list_of("tiny")
        DAMAGE[kind](damaged, place, tmp_path / "other")
        jit._cached_kernels.clear()
        assert not jit._is_stored("tiny")
        assert capsys.readouterr().err.count("compiled again") == (damaged == file and kind != "deleted")
        jit.compile_and_list("tiny", compiled)


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


def test_a_run_loads_what_one_process_compiled_for_all_copies_of_the_package(tmp_path):
    """Two that begin at once with an empty cache, one of them with another copy: one of them compiles, bits agree."""
    copy = tmp_path / "copy" / "srbval"
    shutil.copytree(package_folder(), copy, ignore=shutil.ignore_patterns("__pycache__", "docs"))

    def run(compiled: str, folder: str, package: Path) -> subprocess.Popen[str]:
        env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / folder), "PYTHONPATH": str(package.parent)}
        command = [sys.executable, "-P", "-c", PLANAR_RUN, compiled]
        return subprocess.Popen(command, env=env, cwd=tmp_path, stdout=subprocess.PIPE, text=True)

    def printed(process: subprocess.Popen[str]) -> list[str]:
        return process.communicate()[0].split()

    both = [run("apart", "a", package) for package in (package_folder(), copy)]
    bits, misses, processes = zip(*map(printed, both), strict=True)
    here = printed(run("here", "b", copy))
    assert (misses, sorted(processes)) == (("0", "0"), ["0", "1"])
    assert bits == (here[0], here[0])
    assert here[1:] == ["1", "0"]


TIMES = ("wall_s", "compile_s", "check_wall_s", "stored_utc")
LONG_FORM = {"duration": "20 ms", "settle": "0 s", "detail_rate_hz": 1024.0}
PLANTED = [  # planted together: file, what stands there, what is written in its place; what depends on it
    {
        ("models/full/damping_kernel.py", "BORDER = 6", "BORDER = 7"): {"full", "line", "slices", "rig"},
        ("report/texts/limits.md", "## limits", "## other limits"): set(),
    },
    {
        ("models/planar/ring_kernel.py", "1.0 / 6.0", "1.0 / 7.0"): {"planar", "impulse"},  # which takes its resonance
        ("scene/rig.toml", 'duration = "2 s"', 'duration = "3 s"'): {"rig"},
    },
    {("models/kinematic.py", "CLICK_M_S2 = 1.0", "CLICK_M_S2 = 2.0"): {"kinematic", "planar", "impulse"}},
]
SCRIPT = """
import json
from srbval.models.hierarchy import MODELS
from srbval.models.simulate import RUNS, run_content
from srbval.scene import load_scene, paper_scene
scenes = {m: paper_scene(model=m, duration="50 ms", defect={"kind": "outer"}) for m in MODELS}
scenes["rig"] = load_scene("rig")
keys = {name: RUNS.path(run_content(scene)).name for name, scene in scenes.items()}
print(json.dumps(keys))
"""


def content(run: Run) -> dict[str, Any]:
    """All of a run but its times; without details the shape of their arrays says nothing."""
    kept = {name: value for name, value in asdict(run).items() if name not in TIMES}
    return {name: value for name, value in kept.items() if getattr(value, "size", 1)}


@pytest.mark.parametrize(
    ("scene", "step"),
    [
        (paper_scene(model="impulse", duration="0.2 s", defect={"kind": "inner"}), Step.CHECKED),
        (load_scene("rig", {"model": "kinematic", "duration": "0.2 s", "sensor_path": "rig"}), Step.UNCHECKED),
        (paper_scene(**LONG_FORM, defect={"kind": "roller"}), Step.AUTO),
    ],
)
def test_a_stored_run_is_the_run(scene, step, tmp_path):
    """Signals, details, the step that was chosen and what is known of its error; and its file is the run's file."""
    made, read = (stored_run(scene, step=step) for _ in range(2))
    assert made.stored_utc is None
    assert read.stored_utc is not None
    np.testing.assert_equal(content(made), content(read))
    assert [getattr(made, name) for name in TIMES[:3]] == [getattr(read, name) for name in TIMES[:3]]
    assert type(made.step_error) is type(read.step_error)
    summary = stored_summary(scene, tmp_path / "run.h5", step=step)
    assert [getattr(summary, name) for name in TIMES] == [getattr(read, name) for name in TIMES]
    assert (tmp_path / "run.h5").read_bytes() == RUNS.path(run_content(scene, step)).read_bytes()
    assert stored_run(scene, step=Step.UNCHECKED).stored_utc is None or step is Step.UNCHECKED


def test_what_stands_beside_the_scene_counts(monkeypatch):
    scene = paper_scene(model="impulse", duration="50 ms")
    contents = {run_content(scene, step) for step in Step} | {run_content(paper_scene(model="impulse", seed=7))}
    monkeypatch.setattr("srbval.models.simulate.machine", lambda: "another processor")
    assert len(contents | {run_content(scene)}) == 5


def test_the_user_is_told(srbval_text, tmp_path):
    command = ["simulate", "--model", "impulse", "--seconds", "0.1", "--json"]
    told, stored = [], []
    for more in ([], [], ["-o", str(tmp_path / "run.h5")], ["--fresh"]):
        printed = srbval_text(*command, *more)
        told.append(bool(re.search(r"results from the cache, computed 20.*; --fresh computes again", printed.err)))
        stored.append(json.loads(printed.out)["stored_utc"] is not None)
    assert told == stored == [False, True, True, False]


def test_a_change_invalidates_what_depends_on_it_and_nothing_else(tmp_path):
    """A constant of a kernel, of a model, of a scene file and of a text is planted in a copy of the package."""
    package = tmp_path / "copy" / "srbval"
    shutil.copytree(package_folder(), package, ignore=shutil.ignore_patterns("__pycache__", "docs"))
    environment = os.environ | {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(tmp_path / "cache")}

    def found() -> dict[str, str]:
        command = [sys.executable, "-c", SCRIPT]
        done = subprocess.run(command, env=environment, capture_output=True, cwd=tmp_path, check=True)
        return dict(json.loads(done.stdout))

    before = found()
    for changes in PLANTED:
        texts = {package / file: (package / file).read_text(encoding="utf-8") for file, *_ in changes}
        for file, old, new in changes:
            text = texts[package / file]
            assert old in text
            (package / file).write_text(text.replace(old, new), encoding="utf-8")
        after, depends = found(), set().union(*changes.values())
        assert {name for name, key in after.items() if key != before[name]} == depends, changes
        for source, text in texts.items():
            source.write_text(text, encoding="utf-8")
