"""Sees that a Dask cluster has workers: without any a client would wait for ever."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import Any

LOOKS = 8  # how often in the time that is allowed


@contextmanager
def watched(client: Any, futures: Callable[[], Collection[Any]], *, wait_s: float) -> Iterator[None]:
    """Cancel `futures` once the cluster of `client` has had no worker for `wait_s` [s]: their results then raise."""
    ended = threading.Event()

    def look() -> None:
        seen = time.monotonic()
        while not ended.wait(wait_s / LOOKS):
            if client.nthreads():
                seen = time.monotonic()
            elif time.monotonic() - seen > wait_s:
                client.cancel(list(futures()), force=True)
                return

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
