"""Formats, each with its loader, which runs in a child process of limited computing time and memory.

A few flipped bytes make a C library loop for ever, crash or take gigabytes. Computing time is limited, not time: a
busy machine refuses nothing. If the system lacks a limit (Windows, macOS for memory) the wait for an answer has one.
"""

import atexit
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import DataError
from srbval.processes.worker import DiedError, WorkerProcess
from srbval.recordings.raw import EXPANSION, RawFile, memory_limit_bytes

COMPUTING_S = 3.0  # for any file; a good one of 10 MB takes 0.1 s
BYTES_PER_S = 20e6  # and more for a large one; decompression manages ten times that
WAITING = 12  # times the computing time
WORKSPACE_BYTES = 128 * 2**20  # beside the contents: chunks being decompressed
READER = "srbval.recordings.loaders.reader_process"
CRASHES = ("SIGSEGV", "SIGBUS", "SIGABRT", "SIGFPE", "SIGILL")

# Several threads take from them and give back, each in one atomic step.
_idle: list[WorkerProcess] = []
_running: set[WorkerProcess] = set()


@dataclass(frozen=True)
class FileFormat:
    """A format, the pattern of a file's first bytes (``.`` is any byte), and its loader, a function of a module.

    Unless it is `trusted`, `read` may raise anything, hang or crash: it runs in a process with limits. `library` is the
    module to import before the limits hold, and the name to install it by; `kind` is what messages call a file. The
    contents may take `expansion` times the file's size.
    """

    name: str
    description: str
    mark: bytes
    read: Callable[[Path], RawFile]
    kind: str = "file"
    library: tuple[str, str] | None = None
    expansion: int = EXPANSION
    trusted: bool = False

    def load(self, path: Path) -> RawFile:
        """Load the file at `path`; `DataError` if that fails or takes too much.

        Any exception here ends the process that reads. A new process tries again if one dies that had read other files.
        """
        if self.trusted:
            return self.read(path)
        computing_s = math.ceil(COMPUTING_S + path.stat().st_size / BYTES_PER_S)
        folder = None if path.is_absolute() else os.getcwd()
        memory = memory_limit_bytes(path, self.expansion) + WORKSPACE_BYTES
        request = (self.read, path, folder, computing_s, memory, self.library, self.kind)
        for fresh in (False, True):
            try:
                reader = WorkerProcess(READER, may_fork=True) if fresh else _idle.pop()
                reader.start()
            except IndexError:
                continue
            except OSError as error:
                started = f"no process could be started to read it ({error.strerror})"
                raise DataError(f"{path}: {started}. Try again.") from None
            _running.add(reader)
            start = time.monotonic()
            try:
                answer: RawFile | DataError = reader.call(request, limit_s=WAITING * computing_s)
            except BaseException as error:
                how, waited = str(error), time.monotonic() - start >= WAITING * computing_s
                reader.kill()
                reader.close()
                interrupted = reader not in _running
                _running.discard(reader)
                if not isinstance(error, DiedError):
                    raise
                if interrupted:
                    raise DataError(f"{path}: not read, as the program was interrupted.") from None
                if fresh or waited or how.endswith("SIGXCPU"):
                    break
            else:
                _idle.append(reader)
                if isinstance(answer, DataError):
                    raise answer
                return answer
        if waited:
            text = f"could not be read within {WAITING * computing_s} s; its disk may not answer. Try again, or copy it"
        elif how.endswith("SIGXCPU"):
            text = f"reading it took more than {computing_s} s of computing time. The file is damaged; copy it again"
        elif how.endswith(CRASHES):
            text = f"the library that reads it crashed ({how}). The file is damaged; copy it again"
        else:
            text = f"the process that reads it ended ({how}), perhaps for lack of memory. Try again; see: srbval doctor"
        raise DataError(f"{path}: {text}")


@atexit.register
def end_readers() -> None:
    """End the processes that read, for another thread too, or wait for the next file."""
    while _running:
        _running.pop().kill()
    while _idle:
        _idle.pop().close()
