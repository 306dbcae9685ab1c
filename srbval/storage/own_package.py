"""Where this package lies, what is shipped with it, and how a child process finds the very same one."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path

from srbval.errors import DataError


def package_folder() -> Path:
    """The folder of `srbval` itself."""
    return Path(str(files("srbval")))


def shipped_folder(name: str) -> Path:
    """A folder that comes with the program: inside an installed package, beside it in a source checkout.

    Raises `DataError` where it is missing.
    """
    package = package_folder()
    for folder in (package / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise DataError(f"{package / name}: no such folder; this installation is incomplete. Install srbval again.")


def child_environment() -> dict[str, str]:
    """Environment variables with which a child process imports this very package, wherever it is started."""
    here = str(package_folder().parent)
    return {"PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}
