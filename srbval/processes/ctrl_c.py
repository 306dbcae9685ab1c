"""Holding back Ctrl-C where nobody could answer it."""

import contextlib
import signal
from collections.abc import Iterator


@contextlib.contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Ctrl-C waits until this ends; processes started within never see it, modules imported within do not take it over.

    dask-jobqueue's `runner`, for one, sets a handler that ends the program as if all were done.
    """
    masks, handler = hasattr(signal, "pthread_sigmask"), signal.getsignal(signal.SIGINT)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]) if masks else ()
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is not handler:
            signal.signal(signal.SIGINT, handler)
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
