"""The version of a result follows from the imports of the code that computes it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from srbval.storage import content_version as module
from srbval.storage.content_version import content_version, sources_of
from srbval.storage.own_package import package_folder

SOURCES = {
    "__init__.py": "from made.unrelated import nothing",
    "entry.py": "from made.near import one\ndef late():\n    from made.room import (\n        late,  # a module\n    )",
    "near.py": '"""Text.\n\nfrom here on prose, not code.\n"""\nimport made.far\nWHERE = "named.toml"',
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


@pytest.mark.parametrize("name", SOURCES)
def test_the_version_changes_with_what_is_used_and_with_nothing_else(name: str, made: Path) -> None:
    before = content_version("made.entry", package=made)
    (made / name).write_text(SOURCES[name] + "\n# changed", encoding="utf-8")
    content_version.cache_clear()
    assert (content_version("made.entry", package=made) != before) == (name in USED)


def test_an_unknown_module_is_an_error(made: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"made\.nowhere"):
        sources_of("made.nowhere", package=made)


def test_no_import_of_this_package_is_overlooked() -> None:
    for source in package_folder().rglob("*.py"):
        text = source.read_text(encoding="utf-8")
        names = set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{source}: relative imports are not followed"
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            elif isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
        assert names <= set(module._imported(text)), source


def test_lazily_imported_rungs_belong_to_a_run() -> None:
    names = {path.relative_to(package_folder()).as_posix() for path in sources_of("srbval.models.simulate")}
    assert {"models/full/contact_kernel.py", "models/planar/rung.py", "bearing/geometry.py"} <= names
    assert not any(name.startswith(("bench/", "report/")) for name in names)


def test_stored_ladder_answers_depend_on_what_reads_the_lines() -> None:
    names = {
        path.relative_to(package_folder()).as_posix() for path in sources_of("srbval.studies.model_hierarchy.study")
    }
    assert {"validation/lines.py", "signal/slip_interval.toml"} <= names


def test_every_kernel_of_the_models_is_behind_the_version_of_the_kernel_cache() -> None:
    """Its folder is named by the content of ``*_kernel.py``: a kernel elsewhere could be loaded out of date."""
    models = package_folder() / "models"
    kernels = {path for path in models.rglob("*.py") if "\n@kernel" in path.read_text(encoding="utf-8")}
    assert len(kernels) > 1
    assert {path.name for path in kernels if not path.stem.endswith("_kernel")} == set()
