"""What a result was computed by follows from the imports of the code that computes it."""

import ast
from pathlib import Path

import pytest

from srbval.storage import sources as module
from srbval.storage.installation import package_folder
from srbval.storage.sources import code_sha256, content_version, sources_of

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


@pytest.mark.parametrize("name", SOURCES)
def test_the_version_changes_with_what_is_used_and_with_nothing_else(name: str, made: Path) -> None:
    content_version.cache_clear()
    before = content_version("made.entry", package=made)
    (made / name).write_text(SOURCES[name] + "\nadded = 1", encoding="utf-8")
    content_version.cache_clear()
    assert (content_version("made.entry", package=made) != before) is (name in USED)


def code_of(folder: Path) -> str:
    code_sha256.cache_clear()
    module._statements.cache_clear()
    return code_sha256(folder, folder)


CODE = "LIMIT = 2\n\n\ndef run(x):\n    return _twice(x)\n\n\ndef _twice(x):\n    return LIMIT * x\n"
SAME = (
    ("study.py", CODE.replace("return _", '"""Words."""\n    return _').replace("* x", "*   x  # why")),
    ("study.py", CODE.replace("_twice", "_doubled")),
    ("moved.py", CODE),
    ("page.py", "shown = 1"),
    ("texts.md", "## words"),
    ("study.toml", '# a remark\nparts = ["full"]\nminutes = 3'),
)
OTHER = (("study.py", CODE.replace("LIMIT = 2", "LIMIT = 3")), ("more.py", "x = 1"), ("study.toml", 'parts = ["line"]'))


@pytest.mark.parametrize(("file", "text"), SAME + OTHER)
def test_the_hash_of_a_study_follows_what_it_computes(file: str, text: str, tmp_path: Path) -> None:
    """Docstrings, formatting, renamed private functions, moved files and pages leave it as it is."""
    (tmp_path / "study.py").write_text(CODE)
    (tmp_path / "study.toml").write_text('parts = ["full"]\nminutes = 2')
    before = code_of(tmp_path)
    if file == "moved.py":
        (tmp_path / "study.py").unlink()
    (tmp_path / file).write_text(text)
    assert (code_of(tmp_path) == before) is ((file, text) in SAME)


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
