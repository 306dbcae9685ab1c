"""How many threads numerical libraries use."""

import contextlib
import functools
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Within, or in a function decorated with it, the libraries that are loaded use one thread.

    Small products are quicker so: threads on a busy machine wait for each other, several times as long as they work.
    """
    with _loaded().limit(limits=1):
        yield


@functools.cache
def _loaded() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()  # takes 8 ms to find them, and then 10 us a limit
