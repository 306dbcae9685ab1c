"""The revision of the source tree that the program runs from."""

from __future__ import annotations

import subprocess

from srbval.storage.own_package import package_folder


def git_revision() -> str | None:
    """Short revision, marked where the tree was changed since; None for an installed copy."""
    root = package_folder().parent
    if not (root / ".git").exists():
        return None
    try:
        text = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"],
            capture_output=True, text=True, timeout=10, check=True,
        ).stdout.strip()  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return text or None
