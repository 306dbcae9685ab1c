"""Where this package lies, and how a child process finds the very same one."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path


def package_folder() -> Path:
    """The folder of `srbval` itself."""
    return Path(str(files("srbval")))


def child_environment() -> dict[str, str]:
    """Environment variables with which a child process imports this very package, wherever it is started."""
    here = str(package_folder().parent)
    return {"PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}
