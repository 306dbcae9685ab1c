"""Find processes by a mark in their environment, list their open ports, and wait for conditions."""

import contextlib
import signal
import socket
import time
from collections.abc import Callable, Mapping

import pytest

HANG_S = 120.0  # longer than any condition that a test waits for


def until(done: Callable[[], object], *, within_s: float = HANG_S) -> None:
    """Wait until `done()` holds."""
    give_up_at = time.monotonic() + within_s
    while not done():
        assert time.monotonic() < give_up_at, "it did not happen"
        time.sleep(0.02)


def answer_ctrl_c() -> None:
    """Answer Ctrl-C, which a shell makes its background processes, and all that these start, ignore."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def marked(mark: Mapping[str, str]) -> dict[int, str]:
    """Command lines by process number of the processes with that mark in their environment; zombies have none."""
    psutil = pytest.importorskip("psutil")
    found = {}
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if mark.items() <= process.environ().items():
                found[process.pid] = " ".join(process.cmdline())
    return found


def listening(pid: int) -> list[tuple[str, int]]:
    """List the addresses and ports at which a process listens."""
    psutil = pytest.importorskip("psutil")
    with contextlib.suppress(psutil.Error):
        connections = psutil.Process(pid).net_connections("inet")
        opened = [c for c in connections if c.type == socket.SOCK_DGRAM or c.status == psutil.CONN_LISTEN]
        return [(c.laddr.ip, c.laddr.port) for c in opened]
    return []


def reachable(pid: int) -> list[tuple[str, int]]:
    """List the addresses and ports of a process that other machines can reach."""
    return [(host, port) for host, port in listening(pid) if host not in ("127.0.0.1", "::1", "::ffff:127.0.0.1")]
