"""The package's own names: all there, and loaded only when used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import srbval


@pytest.mark.parametrize("name", srbval.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(srbval, name) is not None


def test_what_is_promised_is_what_is_loaded_and_what_type_checkers_see() -> None:
    """The source of `srbval` names its public names for Python, for the loading and for type checkers."""
    imports = [(f"srbval.{module}", name) for module, names in srbval._NAMES.items() for name in names]
    tree = ast.parse(Path(srbval.__file__).read_text(encoding="utf-8"))
    (checked,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = [
        (str(node.module), f"{alias.name} as {alias.asname}" if alias.asname else alias.name)
        for node in checked.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]
    assert sorted(seen) == sorted(imports)
    assert sorted(srbval.__all__) == sorted(["__version__", *(name.split(" as ")[-1] for _, name in imports)])


def test_importing_the_package_imports_nothing_else() -> None:
    code = "import sys, srbval; sys.exit(len([m for m in sys.modules if m.split('.')[0] in {'numpy','numba','scipy'}]))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
