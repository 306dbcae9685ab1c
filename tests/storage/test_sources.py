"""What a result was computed by follows from the imports of the code that computes it."""

import ast
from pathlib import Path

import pytest

from srbval.storage import sources as module
from srbval.storage.installation import package_folder
from srbval.storage.sources import content_version, sources_of, sources_sha256

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
def made(tmp_path: Path) -> Path:
    package = tmp_path / "made"
    for name, text in SOURCES.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return package


def test_sources_are_followed_from_import_to_import(made: Path) -> None:
    assert {path.relative_to(made).as_posix() for path in sources_of("made.entry", package=made)} == USED


def hashes(made: Path) -> tuple[str, str]:
    content_version.cache_clear()
    sources_sha256.cache_clear()
    module._statements.cache_clear()
    return content_version("made.entry", package=made), sources_sha256("made.entry", made)


@pytest.mark.parametrize("name", SOURCES)
def test_the_hashes_change_with_what_is_used_and_with_nothing_else(name: str, made: Path) -> None:
    before = hashes(made)
    (made / name).write_text(SOURCES[name] + "\nadded = 1", encoding="utf-8")
    assert [a != b for a, b in zip(hashes(made), before, strict=True)] == [name in USED] * 2


def test_comments_docstrings_formatting_and_moves_leave_the_hash_of_what_sources_do(made: Path) -> None:
    far, named, moved = made / "far.py", made / "named.py", made / "room/moved.py"
    far.write_text('PLACE = "made.named:function"\ndef f(x):\n    """Text."""\n    return 2*x  # why')
    before = hashes(made)
    far.write_text('"""Words."""\n\nPLACE = "made.room.moved:function"')
    named.unlink()
    moved.write_text("def f(\n    x,\n):\n    return 2 * x")
    (made / "named.toml").write_text("# noted\na = 1")
    after = hashes(made)
    assert (after[0] == before[0], after[1] == before[1]) == (False, True)
    moved.write_text("def f(x):\n    return 3 * x")
    assert hashes(made)[1] != before[1]


def test_an_unknown_module_is_an_error(made: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"made\.nowhere"):
        sources_of("made.nowhere", package=made)


def test_no_import_of_this_package_is_overlooked() -> None:
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


def test_lazily_imported_models_belong_to_a_run() -> None:
    names = {path.relative_to(package_folder()).as_posix() for path in sources_of("srbval.models.simulate")}
    assert {"models/full/contact_kernel.py", "models/planar/ring.py", "bearing/geometry.py"} <= names
    assert not any(name.startswith(("studies/", "cli/", "report/findings/")) for name in names)


def test_every_kernel_of_the_models_is_behind_the_version_of_the_kernel_cache() -> None:
    """Its folder is named by the content of ``*_kernel.py``: a kernel elsewhere could be loaded out of date."""
    models = package_folder() / "models"
    kernels = {path for path in models.rglob("*.py") if "\n@kernel" in path.read_text(encoding="utf-8")}
    assert len(kernels) > 1
    assert {path.name for path in kernels if not path.stem.endswith("_kernel")} == set()
