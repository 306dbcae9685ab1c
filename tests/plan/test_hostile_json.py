"""This program's own JSON files with anything in them: an error that names the file, or as if there were none."""

import copy
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.check.check import read_reference, reference_path
from srbval.errors import SrbvalError
from srbval.plan.plan import make_plan
from srbval.plan.table import load_calibration
from srbval.recordings.registry import add, listing
from srbval.recordings.registry.manifest import manifest_path, read_manifest
from srbval.scene import paper_scene
from srbval.storage.installation import package_folder
from srbval.storage.stored_result import SCHEMA_VERSION, newest_result

CASES = int(os.environ.get("SRBVAL_JSON", "100"))
HOSTILE = [None, True, -1, 0, 10**400, 1e308, "", "x" * 5000, "\ud800", "\0", [], {}, [[]], {"a": {}}, [None],
           [{"": 1}]]  # fmt: skip
TEXTS = [b"", b"[" * 200_000, b'{"a": ' * 200_000, b"9" * 5000, b"NaN", b"\xff\xfe{}", b"null", b"[]", b"5",
         b'"\\ud800"', b"{}\0"]  # fmt: skip


def mutated(rng: np.random.Generator, document: Any, hostile: list[Any] = HOSTILE) -> Any:
    """The document with a value somewhere in it replaced by a hostile one, removed or renamed."""
    changed = copy.deepcopy(document)
    at: Any = changed
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = keys[rng.integers(len(keys))]
        inner = at[key]
        if not isinstance(inner, dict | list) or not inner or rng.random() < 0.2:
            break
        at = inner
    kind = rng.random()
    if kind < 0.7:
        at[key] = hostile[rng.integers(len(hostile))]
    elif kind < 0.85 or isinstance(at, list):
        del at[key]
    else:
        at["other"] = at.pop(key)
    return changed


def attack(path: Path, read: Callable[[], object], rng: np.random.Generator) -> int:
    """How often `read` refused what was put into `path`; anything but a refusal is raised."""
    good = path.read_bytes()
    contents = TEXTS + [json.dumps(mutated(rng, json.loads(good))).encode() for _ in range(CASES)]
    refused = 0
    for content in contents:
        path.write_bytes(content)
        try:
            read()
        except SrbvalError:
            refused += 1
    path.write_bytes(good)
    read()
    return refused


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(16)


def test_calibration(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "calibration.json"
    table = json.loads((package_folder() / "plan" / "calibration_paper.json").read_text())
    for part in ("entries", "between"):
        table[part] = table[part][:10]
    path.write_text(json.dumps(table))
    scene = paper_scene(defect={"kind": "outer"})
    assert attack(path, lambda: make_plan(scene, calibration=load_calibration(path)), rng) >= len(TEXTS)


def test_reference(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "reference.json"
    path.write_bytes(reference_path().read_bytes())
    assert attack(path, lambda: read_reference(path), rng) >= len(TEXTS)


def test_manifest(tmp_path: Path, rng: np.random.Generator) -> None:
    (tmp_path / "rig").mkdir()
    for number in range(3):
        np.savetxt(tmp_path / "rig" / f"{number}.csv", rng.normal(size=(500, 2)), delimiter=",")
    add(str(tmp_path / "rig"))
    assert attack(manifest_path(), lambda: (read_manifest(), listing()), rng) >= len(TEXTS)


def test_what_is_no_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "zero.json").symlink_to("/dev/zero")
    for read in (load_calibration, read_reference):
        for name in ("pipe", "zero", "none", "a\0"):
            with pytest.raises(SrbvalError):
                read(tmp_path / f"{name}.json")


@pytest.mark.parametrize("kind", ["stability", "speed_accuracy"])
def test_stored_results(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What cannot be read counts as absent: the shipped one is shown."""
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda _: tmp_path)
    shipped = newest_result(kind)
    stamp = {"kind": kind, "schema_version": SCHEMA_VERSION}
    earlier = {**stamp, "schema_version": SCHEMA_VERSION - 1, "made_utc": "9"}  # of a layout that is no longer read
    hostile = [{**stamp, "made_utc": 5}, {**stamp, "made_utc": "9", "machine": []}, {**stamp}, {"kind": kind}, earlier]
    for content in [*TEXTS, *(json.dumps(document).encode() for document in hostile)]:
        (tmp_path / f"{kind}.json").write_bytes(content)
        found = newest_result(kind)
        assert (found and found.path) == (shipped and shipped.path)
        assert found is None or found.origin["file"]
