"""Recordings of other rigs read by a process of its own, while this one does something else.

Reading lines is Python's own work for the most part, so threads would only take turns with whatever runs here.
``python -m srbval.validation.other_rigs_aside`` is that process: entries on its standard input, records on its output.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
import weakref
from collections.abc import Sequence
from typing import overload

from srbval.models.warm import package_path
from srbval.recordings.registry import RegisteredRecording
from srbval.validation.other_rigs import OtherRecord, read_other_rigs, usable


def read_aside(registered: Sequence[RegisteredRecording], *, jobs: int | None = None) -> Sequence[OtherRecord]:
    """What `read_other_rigs` gives: at once where there is nothing to read, else begun here and waited for later."""
    others = usable(registered)
    return ReadAside(others, jobs) if others else ()


class ReadAside(Sequence[OtherRecord]):
    """Records that are being read; the first look waits for them. A process that fails is made up for here.

    The process ends with the last reference to this.
    """

    def __init__(self, registered: Sequence[RegisteredRecording], jobs: int | None) -> None:
        self._registered, self._jobs = registered, jobs
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "srbval.validation.other_rigs_aside"], env=os.environ | package_path(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        weakref.finalize(self, self._process.kill)
        self._answer = bytearray()
        asked = pickle.dumps((tuple(registered), jobs))
        self._exchange = threading.Thread(target=_exchange, args=(self._process, asked, self._answer), daemon=True)
        self._exchange.start()
        self._read: tuple[OtherRecord, ...] | None = None

    @overload
    def __getitem__(self, index: int) -> OtherRecord: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[OtherRecord]: ...
    def __getitem__(self, index: int | slice) -> OtherRecord | Sequence[OtherRecord]:
        return self._records()[index]

    def __len__(self) -> int:
        return len(self._records())

    def _records(self) -> tuple[OtherRecord, ...]:
        if self._read is None:
            self._exchange.join()
            whole = self._process.returncode == 0
            self._read = pickle.loads(self._answer) if whole else read_other_rigs(self._registered, jobs=self._jobs)
        return self._read


def _exchange(process: subprocess.Popen[bytes], asked: bytes, answer: bytearray) -> None:
    with contextlib.suppress(OSError, ValueError):
        answer += process.communicate(asked)[0]


def main() -> None:
    """Read what is asked for and answer."""
    from threadpoolctl import threadpool_limits

    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not get into the answer
    registered, jobs = pickle.load(sys.stdin.buffer)
    with threadpool_limits(1), answers:
        pickle.dump(read_other_rigs(registered, jobs=jobs), answers)


if __name__ == "__main__":
    main()
