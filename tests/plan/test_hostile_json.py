"""This program's own JSON files with anything in them: refused with a message, or read as if they were absent."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.errors import SrbvalError
from srbval.plan.measured import RESULT, read_errors
from srbval.plan.plan import make_plan
from srbval.recordings.registry import add, listing
from srbval.recordings.registry.manifest import manifest_path
from srbval.scene import paper_scene
from srbval.storage.stored_result import newest_result

CASES = 100
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
    """The document with a value somewhere in it replaced by a hostile one, or removed."""
    at = changed = copy.deepcopy(document)
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = keys[rng.integers(len(keys))]
        if not isinstance(at[key], dict | list) or not at[key] or rng.random() < 0.2:
            break
        at = at[key]
    if rng.random() < 0.7:
        at[key] = HOSTILE[rng.integers(len(HOSTILE))]
    else:
        del at[key]
    return changed


def test_measured_errors() -> None:
    shipped, rng = newest_result(RESULT), np.random.default_rng(16)
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


def test_manifest(tmp_path: Path) -> None:
    (tmp_path / "rig").mkdir()
    rng, refused = np.random.default_rng(17), 0
    np.savetxt(tmp_path / "rig" / "0.csv", rng.normal(size=(500, 2)), delimiter=",")
    add(str(tmp_path / "rig"))
    good = json.loads(manifest_path().read_bytes())
    for content in TEXTS + [json.dumps(mutated(rng, good)).encode() for _ in range(CASES)]:
        manifest_path().write_bytes(content)
        try:
            listing()
        except SrbvalError:
            refused += 1
    assert refused >= len(TEXTS)


def test_a_stored_result_that_cannot_be_read_counts_as_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda _: tmp_path)
    shipped = newest_result(RESULT)
    for content in [*TEXTS, *(json.dumps({"kind": RESULT, "made_utc": made}).encode() for made in (5, "9"))]:
        (tmp_path / f"{RESULT}.json").write_bytes(content)
        found = newest_result(RESULT)
        assert (found and found.path) == (shipped and shipped.path)
