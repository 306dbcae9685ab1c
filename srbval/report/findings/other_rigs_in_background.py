"""Recordings of other rigs read in the background: by a process of their own, while this one does something else.

Reading lines is Python's own work for the most part, so threads would only take turns with whatever runs here.
``python -m srbval.report.findings.other_rigs_in_background`` is that process: entries on its standard input, records on its
output.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
import weakref
from collections.abc import Sequence

from srbval.comparison.other_rigs import OtherRecord, read_other_rigs, usable
from srbval.recordings.registry import RegisteredRecording
from srbval.storage.installation import child_environment


class BackgroundReading:
    """Begins to read the usable ones of `registered` at once; `records` waits for what `read_other_rigs` gives.

    Nothing is started where there is nothing to read. If the process fails, `records` reads them here. The process ends
    with the last reference to this.
    """

    def __init__(self, registered: Sequence[RegisteredRecording], *, jobs: int | None = None) -> None:
        self._registered, self._jobs = tuple(usable(registered)), jobs
        self._answer = bytearray()
        self._process: subprocess.Popen[bytes] | None = None
        if self._registered:
            self._start()

    def records(self) -> tuple[OtherRecord, ...]:
        """The records, in the order of data set and file."""
        if self._process is None:
            return ()
        self._exchange.join()
        if self._process.returncode != 0:
            return read_other_rigs(self._registered, jobs=self._jobs)
        records: tuple[OtherRecord, ...] = pickle.loads(self._answer)
        return records

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "srbval.report.findings.other_rigs_in_background"],
            env=os.environ | child_environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        weakref.finalize(self, self._process.kill)
        request = pickle.dumps((self._registered, self._jobs))
        self._exchange = threading.Thread(target=_exchange, args=(self._process, request, self._answer), daemon=True)
        self._exchange.start()


def _exchange(process: subprocess.Popen[bytes], request: bytes, answer: bytearray) -> None:
    with contextlib.suppress(OSError, ValueError):
        answer += process.communicate(request)[0]


def main() -> None:
    """Read the requested records and write them to standard output."""
    from threadpoolctl import threadpool_limits

    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not get into the answer
    registered, jobs = pickle.load(sys.stdin.buffer)
    with threadpool_limits(1), answers:
        pickle.dump(read_other_rigs(registered, jobs=jobs), answers)


if __name__ == "__main__":
    main()
