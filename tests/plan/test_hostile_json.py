"""This program's own JSON files with anything in them: refused with a message, or read as if they were absent."""

import copy
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.errors import SrbvalError
from srbval.plan.measured import RESULT, read_errors
from srbval.plan.plan import make_plan
from srbval.recordings.registry import add, listing
from srbval.recordings.registry.manifest import manifest_path, read_manifest
from srbval.scene import paper_scene
from srbval.storage.stored_result import SCHEMA_VERSION, newest_result

CASES = int(os.environ.get("SRBVAL_JSON", "100"))
HOSTILE = [
    None,
    True,
    -1,
    0,
    10**400,
    1e308,
    "",
    "x" * 5000,
    "\ud800",
    "\0",
    [],
    {},
    [[]],
    {"a": {}},
    [None],
    [{"": 1}],
]
TEXTS = [b"", b"[" * 200_000, b'{"a": ' * 200_000, b"9" * 5000, b"NaN", b"\xff\xfe{}", b"null", b"[]", b"5", b"{}\0"]


def mutated(rng: np.random.Generator, document: Any) -> Any:
    """The document with a value somewhere in it replaced by a hostile one, removed or renamed."""
    changed = copy.deepcopy(document)
    at: Any = changed
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = keys[rng.integers(len(keys))]
        if not isinstance(at[key], dict | list) or not at[key] or rng.random() < 0.2:
            break
        at = at[key]
    kind = rng.random()
    if kind < 0.7:
        at[key] = HOSTILE[rng.integers(len(HOSTILE))]
    elif kind < 0.85 or isinstance(at, list):
        del at[key]
    else:
        at["other"] = at.pop(key)
    return changed


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(16)


def test_measured_errors(rng: np.random.Generator) -> None:
    shipped = newest_result(RESULT)
    assert shipped is not None
    content = {"bases": shipped.content["bases"], "bounds": shipped.content["bounds"][::20]}
    scene, refused = paper_scene(defect={"kind": "outer"}), 0
    for _ in range(CASES):
        try:
            tables = read_errors(mutated(rng, content))
            make_plan(scene, measured=next(iter(tables.values())))
        except SrbvalError:
            refused += 1
    assert refused > CASES / 10


def test_manifest(tmp_path: Path, rng: np.random.Generator) -> None:
    (tmp_path / "rig").mkdir()
    np.savetxt(tmp_path / "rig" / "0.csv", rng.normal(size=(500, 2)), delimiter=",")
    add(str(tmp_path / "rig"))
    path, refused = manifest_path(), 0
    good = path.read_bytes()
    for content in TEXTS + [json.dumps(mutated(rng, json.loads(good))).encode() for _ in range(CASES)]:
        path.write_bytes(content)
        try:
            assert read_manifest() is not None
            listing()
        except SrbvalError:
            refused += 1
    assert refused >= len(TEXTS)


@pytest.mark.parametrize("kind", ["stability", "speed_accuracy"])
def test_stored_results(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A result that cannot be read counts as absent: the shipped one is shown."""
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda _: tmp_path)
    shipped = newest_result(kind)
    stamp = {"kind": kind, "schema_version": SCHEMA_VERSION}
    earlier = {**stamp, "schema_version": SCHEMA_VERSION - 1, "made_utc": "9"}  # of a layout that is no longer read
    hostile = [{**stamp, "made_utc": 5}, {**stamp, "made_utc": "9", "machine": []}, {**stamp}, {"kind": kind}, earlier]
    for content in [*TEXTS, *(json.dumps(document).encode() for document in hostile)]:
        (tmp_path / f"{kind}.json").write_bytes(content)
        found = newest_result(kind)
        assert (found and found.path) == (shipped and shipped.path)
