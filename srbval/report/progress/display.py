"""The display that shows nothing, and the base of those that show something."""

from __future__ import annotations


class Display:
    """Shows nothing. A kind of display overrides what it shows; `task` is the number that `add` gave."""

    def start(self) -> None:
        """Begin to show."""

    def stop(self) -> None:
        """Leave the stream as it was."""

    def add(self, description: str, total: float | None) -> int:  # noqa: ARG002
        """Announce a task and return its number."""
        return 0

    def update(self, task: int, completed: float) -> None:
        """Show how much of a task is done."""

    def finish(self, task: int) -> None:
        """Show that a task is done."""

    def message(self, text: str) -> None:
        """Show a line of text."""

    def stage(self, text: str) -> None:
        """Show what goes on from now on, and that it does, until the next stage."""
