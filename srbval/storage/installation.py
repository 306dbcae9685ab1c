"""Folder and revision of this package, data shipped with it, the user's cache, and the environment of child processes.

The cache is the folder ``platformdirs.user_cache_dir("srbval")`` with a sub-folder for each kind of content: compiled
kernels, results of studies, and results for scenes and records. Everything in it can be computed again. If
``NUMBA_CACHE_DIR`` names a folder, the kernels are stored in its sub-folder ``srbval``.
"""

import contextlib
import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError

KERNELS, STUDY_RESULTS, SCENE_RESULTS = "kernels", "results", "scene-results"  # kinds of content
KERNEL_VARIABLE = "NUMBA_CACHE_DIR"


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
    command = ["git", "-C", str(package_folder().parent), "status", "--porcelain=v2", "--branch"]
    command += ["--untracked-files=no", "--", ".", ":(exclude)reports"]
    try:
        status = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
    revision = status.removeprefix("# branch.oid ")[:12]
    return f"{revision}-dirty" if re.search("^[^#]", status, re.MULTILINE) else revision


def cache_folder(kind: str = "") -> Path:
    """Folder of one `kind` of cached content (``kernels``, ``results``, ...), or of all; it may not exist yet."""
    import platformdirs

    base = os.environ.get(KERNEL_VARIABLE) if kind == KERNELS else None
    return Path(base, "srbval", kind) if base else Path(platformdirs.user_cache_dir("srbval"), kind)


def cache_use() -> list[dict[str, Any]]:
    """Disk space of every kind of cached content, sorted by name; includes folders of earlier versions of srbval.

    The keys of a row are `kind`, `folder`, number of `files` and `size_bytes`.
    """
    kinds = {path.name for path in cache_folder().glob("*")}
    found = []
    for kind in (kind for kind in sorted(kinds | {KERNELS}) if cache_folder(kind).is_dir()):
        sizes, folder = [], cache_folder(kind)
        for path in folder.rglob("*"):
            with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
                sizes += [path.stat().st_size] if path.is_file() else []
        found.append({"kind": kind, "folder": folder, "files": len(sizes), "size_bytes": sum(sizes)})
    return found


def clear_cache(*kinds: str) -> list[dict[str, Any]]:
    """Delete the folders of these `kinds` (default: all) and return their size; an unknown kind is an error."""
    found = {use["kind"]: use for use in cache_use()}
    if unknown := [kind for kind in kinds if kind not in found]:
        raise ConfigurationError(f"the cache contains no {unknown[0]!r}. It contains: {', '.join(found) or 'nothing'}.")
    chosen = [found[kind] for kind in kinds or found]
    for use in chosen:
        try:
            shutil.rmtree(use["folder"])
        except OSError as error:
            raise DataError(f"{use['folder']}: cannot be deleted ({error.strerror or error}).") from None
    return chosen
