"""Recordings of other rigs read in the background: by a process of their own, while this one does something else.

Reading lines is Python's own work for the most part, so threads would only take turns with whatever runs here.
``python -m srbval.report.findings.other_rigs_in_background`` is that process.
"""

import contextlib
import threading
import weakref
from collections.abc import Sequence
from typing import Any

from srbval.comparison.other_rigs import OtherRecord, read_other_rigs, usable
from srbval.processes.machine import one_thread
from srbval.processes.worker import DiedError, WorkerProcess, serve_calls
from srbval.recordings.registry import RegisteredRecording


class BackgroundReading:
    """Begins to read the usable ones of `registered` at once; `records` waits for what `read_other_rigs` gives.

    Nothing is started where there is nothing to read. If the process fails, `records` reads them here. The process ends
    with the last reference to this.
    """

    def __init__(self, registered: Sequence[RegisteredRecording], *, jobs: int | None = None) -> None:
        self._registered, self._jobs = tuple(usable(registered)), jobs
        self._answer: list[tuple[OtherRecord, ...]] = []
        if self._registered:
            worker = WorkerProcess("srbval.report.findings.other_rigs_in_background")
            weakref.finalize(self, worker.kill)
            request = (worker, (self._registered, jobs), self._answer)
            self._exchange = threading.Thread(target=_ask, args=request, daemon=True)
            self._exchange.start()

    def records(self) -> tuple[OtherRecord, ...]:
        """The records, in the order of data set and file."""
        if not self._registered:
            return ()
        self._exchange.join()
        return self._answer[0] if self._answer else read_other_rigs(self._registered, jobs=self._jobs)


def _ask(worker: WorkerProcess, request: Any, answer: list[Any]) -> None:
    with contextlib.suppress(DiedError):
        answer.append(worker.call(request))
    worker.close()


@one_thread()
def _read(request: tuple[Sequence[RegisteredRecording], int | None]) -> tuple[OtherRecord, ...]:
    registered, jobs = request
    return read_other_rigs(registered, jobs=jobs)


if __name__ == "__main__":
    serve_calls(lambda: _read)
