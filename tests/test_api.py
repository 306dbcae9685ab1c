"""The package's own names: all there, and loaded only when used."""

from __future__ import annotations

import subprocess
import sys

import pytest

import srbval


@pytest.mark.parametrize("name", srbval.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(srbval, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'frobnicate'"):
        _ = srbval.frobnicate


def test_importing_the_package_imports_nothing_else() -> None:
    code = "import sys, srbval; sys.exit(len([m for m in sys.modules if m.split('.')[0] in {'numpy','numba','scipy'}]))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
