"""Runs that were made before: bit for bit what they were, and read as long as nothing changed that they follow from."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from srbval import Run, load_scene, paper_scene
from srbval.models.simulate import RUNS, Step, run_content, stored_run, stored_summary
from srbval.storage.installation import package_folder

TIMES = ("wall_s", "compile_s", "check_wall_s", "stored_utc")
LONG_FORM = {"duration": "20 ms", "settle": "0 s", "detail_rate_hz": 1024.0}
PLANTED = {  # file, what stands there, what is written in its place: what depends on it
    ("models/full/damping_kernel.py", "BORDER = 6", "BORDER = 7"): {"full", "line", "slices", "rig"},
    ("models/planar/ring_kernel.py", "1.0 / 6.0", "1.0 / 7.0"): {"planar", "impulse"},  # which takes its resonance
    ("models/kinematic.py", "CLICK_M_S2 = 1.0", "CLICK_M_S2 = 2.0"): {"kinematic", "planar", "impulse"},
    ("scene/rig.toml", 'duration = "2 s"', 'duration = "3 s"'): {"rig"},
    ("report/texts/limits.md", "What is not known", "What is known"): set(),
}
WITHOUT_KERNELS = ("kinematic", "impulse")
SCRIPT = """
import json
from srbval.models.hierarchy import MODELS
from srbval.models.simulate import RUNS, run_content, stored_run
from srbval.scene import load_scene, paper_scene
scenes = {m: paper_scene(model=m, duration="50 ms", defect={"kind": "outer"}) for m in MODELS}
scenes["rig"] = load_scene("rig")
keys = {name: RUNS.path(run_content(scene)).name for name, scene in scenes.items()}
read = {name: stored_run(scenes[name]).stored_utc is not None for name in ("kinematic", "impulse")}
print(json.dumps({"keys": keys, "read": read}))
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
        told.append(bool(re.search(r"read from the cache of 20.*; --fresh computes again", printed.err)))
        stored.append(json.loads(printed.out)["stored_utc"] is not None)
    assert told == stored == [False, True, True, False]


def test_a_change_invalidates_what_depends_on_it_and_nothing_else(tmp_path):
    """A constant of a kernel, of a model, of a scene file and of a text is planted in a copy of the package."""
    package = tmp_path / "copy" / "srbval"
    shutil.copytree(package_folder(), package, ignore=shutil.ignore_patterns("__pycache__", "docs"))
    environment = os.environ | {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(tmp_path / "cache")}

    def found() -> dict[str, dict[str, Any]]:
        command = [sys.executable, "-c", SCRIPT]
        done = subprocess.run(command, env=environment, capture_output=True, cwd=tmp_path, check=True)
        return dict(json.loads(done.stdout))

    before = found()
    assert before["read"] == dict.fromkeys(WITHOUT_KERNELS, False)
    for (file, old, new), depends in PLANTED.items():
        source = package / file
        text = source.read_text(encoding="utf-8")
        assert old in text
        source.write_text(text.replace(old, new), encoding="utf-8")
        after = found()
        assert {name for name, key in after["keys"].items() if key != before["keys"][name]} == depends, file
        assert after["read"] == {name: name not in depends for name in WITHOUT_KERNELS}, file
        source.write_text(text, encoding="utf-8")
