"""How far the work is: one callback signature for the whole package, and its display on standard error.

Whatever takes long has an option ``progress: Progress = silent`` and calls it with the name of the task and the
fraction of it that is done. `ProgressDisplay` is such a callback and shows what it is told: bars on a terminal, plain
lines elsewhere. All of them are safe to call from several threads.
"""

import contextlib
from collections.abc import Callable, Iterator

from srbval.progress.display import ProgressDisplay

__all__ = ["Progress", "ProgressDisplay", "prefixed", "silent", "stage"]

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
