"""How a benchmark says where it is: a task's name and the share of it that is done, 0 to 1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]


def silent(task: str, share: float) -> None:
    """Say nothing."""
