"""Where this package lies, its revision, what is shipped with it, and how a child process finds the very same one."""

import os
import shlex
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

from srbval.errors import ConfigurationError, DataError


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
    """Environment variables with which a child process imports the same package, wherever it is started."""
    here = str(package_folder().parent)
    return {"PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}


def pip_command(*libraries: str) -> str:
    """The command that installs `libraries` for the Python that runs, quoted for this system's shell.

    It names them, and no extra of srbval: srbval is on no package index, and the folder or wheel that it was installed
    from may be gone.
    """
    words = [sys.executable, "-m", "pip", "install", *libraries]
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


class MissingLibraryError(ConfigurationError):
    """What is asked for (`what`) needs libraries that are not installed: the message has the command that does it."""

    def __init__(self, what: str, *libraries: str) -> None:
        super().__init__(f"{what} needs {' and '.join(libraries)}, not installed: {pip_command(*libraries)}")


def is_source_tree() -> bool:
    """True if the package lies in its repository, False for an installed copy."""
    return (package_folder().parent / ".git").exists()


def git_revision() -> str | None:
    """Short git revision of the source tree, marked if anything but ``reports`` has changed since; None if installed.

    Stored results are written one after another, so that a change of ``reports`` alone does not mark the later ones.
    """
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
