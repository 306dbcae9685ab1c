"""The layout is the pipeline: a room imports only from rooms above it in this list, and nothing in a circle."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import srbval

ORDER = (
    "errors",
    "arrays",
    "config",
    "storage",
    "progress",
    "processes",
    "bearing",
    "scene",
    "models",
    "recordings",
    "signal",
    "reading",
    "diagnosis",
    "comparison",
    "path",
    "plan",
    "campaign",
    "check",
    "report",
    "studies",
    "cli",
)
PACKAGE = Path(srbval.__file__).parent
SOURCES = {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(PACKAGE.rglob("*.py"))}
FILES = [path for path in SOURCES if path.parent not in (PACKAGE, PACKAGE / "docs")]
DRAWING = ("srbval.report.", "srbval.figures.")
WRITING_FUNCTIONS = {"document", "json_object", "strict_json", "write_json"}
MOST_LINES = 40_800  # so that the whole of it can be read; what grows here makes something else superfluous
MOST_FILES = 351  # so that a newcomer finds the one to change
LONGEST_FUNCTION = 80  # lines; more does not fit on a screen. Kernels are compiled as a whole and may be longer.


def module_name(path: Path) -> str:
    """Dotted name of a file of the package."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_name(path) for path in SOURCES}


def imported(tree: ast.AST) -> Iterator[str]:
    """Every module of the package that is imported anywhere in a file, within functions too, but not for types only."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "srbval":
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in MODULES else node.module or ""
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "srbval")
        else:
            yield from imported(node)


def imported_rooms(path: Path) -> set[str]:
    """Rooms that a file imports from, for types too."""
    rooms = set()
    for node in ast.walk(SOURCES[path]):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [a.name for a in node.names] if isinstance(node, ast.Import) else []
        rooms |= {n.split(".")[1] for n in names if n.startswith("srbval.")}
    return rooms


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_only_run_forward(path: Path) -> None:
    room = path.relative_to(PACKAGE).parts[0]
    later = {r for r in imported_rooms(path) if ORDER.index(r) > ORDER.index(room)}
    assert not later, f"{room} must not import {later}"


def test_no_import_circle() -> None:
    """Imports within functions count: they only hide a circle."""
    graph = {module_name(path): set(imported(tree)) - {module_name(path)} for path, tree in SOURCES.items()}
    del graph["srbval"]  # its names are loaded when they are used
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_nothing_imports_the_whole_package() -> None:
    """`import srbval` needs no path and no name that a room does not offer itself; the version alone stands there."""
    for path in FILES:
        for node in ast.walk(SOURCES[path]):
            if isinstance(node, ast.Import):
                assert "srbval" not in [alias.name for alias in node.names], path
            if isinstance(node, ast.ImportFrom) and node.module == "srbval":
                assert {alias.name for alias in node.names} <= {"__version__", *ORDER}, path


def test_no_class_name_occurs_twice() -> None:
    names = Counter(node.name for tree in SOURCES.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    assert [name for name, count in names.items() if count > 1] == []


def offered(path: Path) -> set[str]:
    """Names in the ``__all__`` of a file."""
    for node in SOURCES[path].body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def test_one_import_path_for_each_name() -> None:
    """What a folder offers in its ``__all__`` the files outside import from the folder, not from the module."""
    folders = {module_name(p): offered(p) for p in FILES if p.name == "__init__.py" and offered(p)}
    for path, tree in SOURCES.items():
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom) or node.module in folders:
                continue
            for folder, names in folders.items():
                if (node.module or "").startswith(folder + ".") and not module_name(path).startswith(folder):
                    twice = names & {alias.name for alias in node.names}
                    assert not twice, f"{path.relative_to(PACKAGE)}: import {twice} from {folder}"


def test_there_are_not_too_many_files() -> None:
    assert len(SOURCES) <= MOST_FILES


def test_there_are_not_too_many_lines() -> None:
    assert sum(len(source.read_text(encoding="utf-8").splitlines()) for source in SOURCES) <= MOST_LINES


def test_no_function_is_too_long() -> None:
    for path, tree in SOURCES.items():
        if path.stem.endswith("_kernel"):
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                length = (node.end_lineno or 0) - node.lineno + 1
                assert length <= LONGEST_FUNCTION, f"{path.relative_to(PACKAGE)}: {node.name}: {length} lines"


def test_the_report_computes_nothing() -> None:
    """Of other rooms, the figures' apart, it takes types and constants, and of functions those that write what is."""
    for path in (PACKAGE / "report").rglob("*.py"):
        for node in ast.walk(SOURCES[path]):
            if isinstance(node, ast.ImportFrom) and not f"{node.module}.".startswith(DRAWING):
                names = {alias.name for alias in node.names} if f"{node.module}.".startswith("srbval.") else set()
                functions = {name for name in names if name.islower()}
                assert functions <= WRITING_FUNCTIONS, f"{path.relative_to(PACKAGE)}: {functions}"


def test_signal_knows_only_arrays() -> None:
    for path in (PACKAGE / "signal").glob("*.py"):
        assert imported_rooms(path) <= {"errors", "arrays", "signal"}, path.name


@pytest.mark.parametrize("heavy", ["numba", "scipy.signal", "matplotlib", "pandas", "h5py", "pywt", "rich"])
def test_help_loads_nothing_heavy(heavy: str) -> None:
    code = f"import sys; from srbval.cli.arguments import parser; parser(); sys.exit({heavy!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
