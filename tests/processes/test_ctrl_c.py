"""Ctrl-C stays what it was, whatever a module does to it while it is imported."""

from __future__ import annotations

import signal
import sys
import threading

import pytest

from srbval.processes.worker import without_ctrl_c

pytestmark = pytest.mark.skipif(
    threading.current_thread() is not threading.main_thread(), reason="signals are handled in the main thread"
)


def test_a_handler_set_within_is_taken_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with without_ctrl_c():
        signal.signal(signal.SIGINT, lambda *_: sys.exit())  # as dask-jobqueue does when it is imported
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals cannot be held back here")
def test_ctrl_c_within_comes_afterwards() -> None:
    seen: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: seen.append(number))
    try:
        with without_ctrl_c():
            signal.raise_signal(signal.SIGINT)
            assert seen == []
        assert seen == [signal.SIGINT]
    finally:
        signal.signal(signal.SIGINT, before)
