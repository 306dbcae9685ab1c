"""Sources that a result follows from, the newest stored result that can be read, why evidence no longer holds."""

import ast
import math
from pathlib import Path
from typing import Any

import pytest

from srbval.storage import sources as module
from srbval.storage import stored_result
from srbval.storage.installation import package_folder
from srbval.storage.json_files import write_json
from srbval.storage.sources import code_sha256, content_version
from srbval.storage.stored_result import StoredResult, compare_part, fingerprint_of, newest_result

SOURCES = {
    "__init__.py": "from made.unrelated import nothing",
    "entry.py": "from made.near import one\ndef late():\n    from made.room import (\n        late,  # a module\n    )",
    "near.py": '"""Text.\n\nfrom here on prose, not code.\n"""\nimport made.far\n'
    'if TYPE_CHECKING:\n    import made.unrelated\nWHERE = "named.toml"',
    "far.py": 'PLACE = "made.named:function"',
    "named.py": "",
    "named.toml": "a = 1",
    "unnamed.toml": "b = 1",
    "room/__init__.py": "",
    "room/late.py": "import made.entry",
    "room/other.py": "",
    "unrelated.py": "import made.entry",
}
USED = {"entry.py", "near.py", "far.py", "named.py", "named.toml", "room/__init__.py", "room/late.py"}


@pytest.fixture
def made(tmp_path):
    package = tmp_path / "made"
    for name, text in SOURCES.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return package


@pytest.mark.parametrize("name", SOURCES)
def test_the_version_changes_with_what_is_used_and_with_nothing_else(name, made):
    content_version.cache_clear()
    before = content_version("made.entry", package=made)
    (made / name).write_text(SOURCES[name] + "\nadded = 1", encoding="utf-8")
    content_version.cache_clear()
    assert (content_version("made.entry", package=made) != before) is (name in USED)


def code_of(folder: Path) -> str:
    code_sha256.cache_clear()
    return code_sha256(folder)


IMPORTS = "from studies.bench import run_all\nfrom studies.harness import StudyResult\n\n"
CODE = IMPORTS + "LIMIT = 2\n\n\ndef run(x):\n    return _twice(x)\n\n\ndef _twice(x):\n    return LIMIT * x\n"
SAME = (
    ("study.py", CODE.replace("return _twice(x)", "'It\\'s \"so\".'\n    return (_twice(\n        x,\n    ))  # why")),
    ("study.py", CODE.replace("_twice", "_doubled")),
    ("moved.py", CODE),
    ("page.py", "shown = 1"),
    ("../harness.py", "x = 1"),
    ("../other.py", "x = 1"),
    ("texts.md", "## words"),
    ("study.toml", '# a remark\nparts = ["full"]\nquestion = "b"'),
)
OTHER = (
    ("study.py", CODE.replace("LIMIT = 2", "LIMIT = 3")),
    ("more.py", "x = 1"),
    ("study.toml", 'parts = ["line"]'),
    ("../bench.py", "x = 1"),
)


@pytest.mark.parametrize(("file", "text"), SAME + OTHER)
def test_the_hash_of_a_study_follows_what_it_computes(file, text, tmp_path):
    """Docstrings, formatting, renamed private functions, moved files and pages leave it as it is."""
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "study.py").write_text(CODE)
    (folder / "study.toml").write_text('parts = ["full"]\nquestion = "a"')
    before = code_of(folder)
    if file == "moved.py":
        (folder / "study.py").unlink()
    (folder / file).write_text(text)
    assert (code_of(folder) == before) is ((file, text) in SAME)


def test_no_import_of_this_package_is_overlooked():
    for source in package_folder().rglob("*.py"):
        text = source.read_text(encoding="utf-8")
        names, tree = set(), ast.parse(text)
        tree.body = [n for n in tree.body if not (isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")]
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{source}: relative imports are not followed"
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            elif isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
        assert names <= set(module._imported(text)), source


def test_every_kernel_of_the_models_is_behind_the_version_of_the_kernel_cache():
    """Its folder is named by the content of ``*_kernel.py``: a kernel elsewhere could be loaded out of date."""
    models = package_folder() / "models"
    kernels = {path for path in models.rglob("*.py") if "\n@kernel" in path.read_text(encoding="utf-8")}
    assert len(kernels) > 1
    assert {path.name for path in kernels if not path.stem.endswith("_kernel")} == set()


NAME = "stability"
NOW = {"full": {"outer: cage_ratio": 0.43, "outer: rms_m_s2": 2.0}, "reading": {"H: hz": 97.0}}
CONTENT: dict[str, Any] = {
    "schema_version": 3, "kind": NAME, "made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc",
    "command": "srbval evidence", "minutes": 5.5, "machine": {"processor": "P", "usable_cores": 2},
    "code_sha256": "own", "fingerprint": {"full": NOW["full"]},
}  # fmt: skip


@pytest.fixture(autouse=True)
def own_hash(monkeypatch):
    monkeypatch.setattr(stored_result, "code_sha256", lambda _: "own")


def result(**changes: Any) -> StoredResult:
    return StoredResult(path=Path(f"{NAME}.json"), content=CONTENT | changes)


def test_the_newest_is_found_with_its_origin(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_result, "cache_folder", lambda _: tmp_path / "cache")
    monkeypatch.setattr(stored_result, "shipped_folder", lambda _: tmp_path)
    assert newest_result(NAME) is None
    write_json(tmp_path / f"{NAME}.json", CONTENT)
    (tmp_path / "cache").mkdir()
    write_json(tmp_path / "cache" / f"{NAME}.json", CONTENT | {"made_utc": "2026-01-02T00:00:00+00:00"})
    found = newest_result(NAME)
    assert found is not None
    assert found.path.parent.name == "cache"
    assert found.origin == {
        "kind": "evidence", "made_utc": "2026-01-02T00:00:00+00:00", "git_revision": "abc", "minutes": 5.5,
        "command": "srbval evidence", "processor": "P", "usable_cores": 2, "file": f"{NAME}.json",
    }  # fmt: skip
    for wrong in (b"[" * 200_000, b"\xff\xfe{}", b"null", b'{"kind": "another"}'):
        (tmp_path / "cache" / f"{NAME}.json").write_bytes(wrong)
        assert newest_result(NAME).path.parent == tmp_path


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({}, None),
        ({"git_revision": "abc-dirty"}, "changed working tree"),
        ({"code_sha256": "other"}, "has changed"),
        ({"fingerprint": None}, "does not state the fingerprint"),
        ({"fingerprint": {"full": {**NOW["full"], "outer: rms_m_s2": 2.001}}}, "part full behaves differently"),
        ({"fingerprint": {"full": {**NOW["full"], "gone": 1.0}}}, "gone"),
        ({"code_sha256": "other", "evidence_kind": "recorded"}, None),
        ({"code_sha256": "other", "computed_once": "blind"}, None),
    ],
)
def test_only_evidence_is_stale_if_what_it_depends_on_has_changed(changes, why):
    found = result(**changes).why_stale(NOW)
    assert found is None if why is None else why in (found or "")


def test_values_agree_within_their_tolerance():
    for name, one, other, agree in (
        ("outer: rms_m_s2", 1e-12, 3e-11, True),  # rounding of a theoretical zero
        ("outer: cage_ratio", 0.43, 0.43 * (1 + 1e-7), True),
        ("outer: cage_ratio", 0.43, 0.43 * (1 + 1e-5), False),
        ("a", math.nan, math.nan, True),
        ("a", math.nan, 1.0, False),
        ("a", math.inf, math.inf, True),
        ("a: status", "ok", "skidding", False),
    ):
        assert [found["ok"] for found in compare_part({name: one}, {name: other})] == [agree], (name, one, other)
    found = compare_part({"b": 2.1, "c": 3.0}, {"a": 1.0, "b": 2.0})
    assert [(one["name"], one["ok"]) for one in found] == [("b", False), ("c", False), ("a", False)]
    assert fingerprint_of({"a": {"b": None}})["a"]["b"] != 0
