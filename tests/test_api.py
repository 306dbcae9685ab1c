"""The package's public names exist, and are loaded only when used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import srbval


@pytest.mark.parametrize("name", srbval.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(srbval, name) is not None


def test_what_is_loaded_is_what_type_checkers_see() -> None:
    stub = ast.parse(Path(srbval.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    (seen,) = (ast.literal_eval(node.value) for node in stub.body if isinstance(node, ast.Assign))
    assert sorted(srbval.__all__) == sorted(seen)


def test_importing_the_package_imports_nothing_else() -> None:
    code = "import sys, srbval; sys.exit(len([m for m in sys.modules if m.split('.')[0] in {'numpy','numba','scipy'}]))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
