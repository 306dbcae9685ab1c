"""The signature of every progress callback, the callback that does nothing, and ways to call one."""

import contextlib
from collections.abc import Callable, Iterator

Progress = Callable[[str, float | None], None]
"""Called with the name of a task and the fraction of it that is done, 0 to 1.

1.0 means done; None means begun, with an extent that is not known. A task begins with the first call that names it.
"""


def silent(task: str, fraction: float | None) -> None:
    """Show nothing."""


@contextlib.contextmanager
def stage(progress: Progress, task: str) -> Iterator[None]:
    """Report `task`, of unknown extent, as begun on entry and as done on a normal exit."""
    progress(task, None)
    yield
    progress(task, 1.0)


def prefixed(progress: Progress, title: str) -> Progress:
    """The same callback with `title` and a colon before the name of every task."""
    return lambda task, fraction: progress(f"{title}: {task}", fraction)
