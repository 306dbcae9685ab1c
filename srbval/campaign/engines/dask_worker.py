"""What each worker process of an embedded Dask cluster does first; Dask finds it by its name, as a preload."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(_: Any) -> None:
    """Leave Ctrl-C, which reaches all processes of a terminal, to the campaign's own process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
