"""The layout is the pipeline: a folder imports only from folders above it in this list."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import srbval

ORDER = (
    "errors",
    "config",
    "storage",
    "progress",
    "bearing",
    "scene",
    "models",
    "recordings",
    "signal",
    "validation",
    "bench",
    "stability",
    "plan",
    "campaign",
    "check",
    "evidence",
    "report",
    "cli",
)
PACKAGE = Path(srbval.__file__).parent
FILES = sorted(p for p in PACKAGE.rglob("*.py") if p.parent not in (PACKAGE, PACKAGE / "docs"))


def imported_rooms(path: Path) -> set[str]:
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [a.name for a in node.names] if isinstance(node, ast.Import) else []
        rooms |= {n.split(".")[1] for n in names if n.startswith("srbval.")}
    return rooms


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_only_run_forward(path: Path) -> None:
    room = path.relative_to(PACKAGE).parts[0]
    later = {r for r in imported_rooms(path) if ORDER.index(r) > ORDER.index(room)}
    assert not later, f"{room} must not import {later}"


def test_signal_knows_only_arrays() -> None:
    for path in (PACKAGE / "signal").glob("*.py"):
        assert imported_rooms(path) <= {"errors", "signal"}, path.name


@pytest.mark.parametrize("heavy", ["numba", "scipy.signal", "matplotlib", "pandas", "h5py", "pywt", "rich"])
def test_help_loads_nothing_heavy(heavy: str) -> None:
    code = f"import sys; from srbval.cli.arguments import parser; parser(); sys.exit({heavy!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
