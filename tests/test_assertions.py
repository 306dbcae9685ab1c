"""Every test asserts something, itself or through a helper of its file that does."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent
ASSERTING = ("raises", "warns", "fail")  # calls that let a test fail without the word `assert`


def asserting_names(path: Path) -> tuple[dict[str, ast.FunctionDef], set[str]]:
    """The functions of a file by name, and the names of those that assert, directly or through others of the file."""
    functions = {n.name: n for n in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(n, ast.FunctionDef)}
    calls = {name: called(node) for name, node in functions.items()}
    found = {name for name, node in functions.items() if asserts(node)}
    while more := {name for name, names in calls.items() if name not in found and names & found}:
        found |= more
    return functions, found


def asserts(function: ast.FunctionDef) -> bool:
    """Does it hold an assertion, or a call that is one?"""
    names = called(function)
    return (
        any(isinstance(node, ast.Assert) for node in ast.walk(function))
        or any(name in ASSERTING or name.startswith("assert") for name in names)
    )  # fmt: skip


def called(function: ast.FunctionDef) -> set[str]:
    """Names that are called within a function."""
    targets = [node.func for node in ast.walk(function) if isinstance(node, ast.Call)]
    return {t.id if isinstance(t, ast.Name) else t.attr for t in targets if isinstance(t, ast.Name | ast.Attribute)}


@pytest.mark.parametrize("path", sorted(ROOT.rglob("test_*.py")), ids=lambda path: str(path.relative_to(ROOT)))
def test_every_test_asserts(path: Path) -> None:
    functions, found = asserting_names(path)
    assert {name for name in functions if name.startswith("test_")} <= found
