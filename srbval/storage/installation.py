"""Folder and revision of this package, data shipped with it, and the environment of child processes."""

import importlib
import os
import shlex
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError


def package_folder() -> Path:
    """Folder of the package `srbval`."""
    return Path(str(files("srbval")))


def shipped_folder(name: str) -> Path:
    """Folder shipped with srbval, in an installed package or a source checkout; `DataError` if it is missing."""
    package = package_folder()
    for folder in (package / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise DataError(f"{package / name}: no such folder; this installation is incomplete. Install srbval again.")


def child_environment() -> dict[str, str]:
    """Environment variables with which a child process imports the same copy of srbval."""
    here = str(package_folder().parent)
    return {"PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}


def pip_command(*libraries: str) -> str:
    """Shell command that installs `libraries` for the running Python."""
    words = [sys.executable, "-m", "pip", "install", *libraries]
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def import_library(module: str, feature: str, *libraries: str) -> Any:
    """Import the `module` that a `feature` needs; if it is missing, an error states how to install `libraries`."""
    try:
        return importlib.import_module(module)
    except ImportError:
        needed = libraries or (module,)
        raise ConfigurationError(f"{feature} needs {' and '.join(needed)}. Install: {pip_command(*needed)}") from None


def is_source_tree() -> bool:
    """True if the package is in its repository, False for an installed copy."""
    return (package_folder().parent / ".git").exists()


def git_revision() -> str | None:
    """Short git revision, with ``-dirty`` if files outside ``reports`` have changed; None for an installed copy."""
    if not is_source_tree():
        return None

    def git(*words: str) -> str:
        root = str(package_folder().parent)
        command = ["git", "-C", root, *words]
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()

    try:
        revision = git("rev-parse", "--short=12", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":(exclude)reports")
    except (OSError, subprocess.SubprocessError):
        return None
    return f"{revision}-dirty" if changed else revision
