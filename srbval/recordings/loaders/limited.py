"""File formats and their loaders, which run in a child process with limited computing time and memory.

A few damaged bytes can make a C library loop for ever, crash or allocate gigabytes. Computing time is limited instead
of elapsed time, so that no file is rejected because the machine is busy. A much longer limit of the elapsed time
applies as well, because Windows does not limit computing time and memory, and macOS does not limit memory.
"""

import atexit
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.errors import DataError
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess
from srbval.recordings.raw import RawFile

COMPUTING_S = 3.0  # for any file; an intact file of 10 MB needs 0.1 s
BYTES_PER_S = 20e6  # more time for a large file; decompression is ten times faster
WAITING = 12  # limit of the elapsed time divided by the limit of the computing time
EXPANSION = 2  # size of the contents divided by the size of the file: measured noise hardly compresses
WORKSPACE_BYTES = 256 * 2**20  # in addition, for small files that expand more and for chunks during decompression
READER = "srbval.recordings.loaders.reader_process"

# Shared by threads; each access is one atomic operation.
_idle: list[WorkerProcess] = []
_running: set[WorkerProcess] = set()


@dataclass(frozen=True)
class FileFormat:
    """File format: pattern `mark` of a file's first bytes (``.`` is any byte), and the loader `read`.

    Unless `trusted`, `read` may raise anything, hang or crash: it runs in a process with limits. `library` contains the
    module to import before the limits apply, and the name of the package to install. The contents may need
    `expansion` times the size of the file in memory.
    """

    name: str
    description: str
    mark: bytes
    read: Callable[[Path], RawFile]
    library: tuple[str, str] | None = None
    expansion: int = EXPANSION
    trusted: bool = False

    def load(self, path: Path) -> RawFile:
        """Load a file, in a child process unless `trusted`; `DataError` if the loader fails or exceeds a limit."""
        raw = self.read(path) if self.trusted else self._read_in_child(path)
        return raw if raw.format else replace(raw, format=self.name)

    def _read_in_child(self, path: Path) -> RawFile:
        computing_s = math.ceil(COMPUTING_S + path.stat().st_size / BYTES_PER_S)
        folder = None if path.is_absolute() else os.getcwd()
        memory = self.expansion * path.stat().st_size + WORKSPACE_BYTES
        request = (self, path, folder, computing_s, memory)
        for fresh in (False, True):  # a new process tries again if one dies that has read other files
            try:
                reader = WorkerProcess(READER, may_fork=True) if fresh else _idle.pop()
                reader.start()
            except IndexError:
                continue
            except OSError as error:
                raise DataError(f"{path}: cannot start a process to read it ({error.strerror}). Try again.") from None
            _running.add(reader)
            try:
                answer: RawFile | DataError = reader.call(request, limit_s=WAITING * computing_s)
            except DiedError as error:
                if reader not in _running:
                    raise DataError(f"{path}: not read, as the program was interrupted.") from None
                died, how = error, str(error)
                if fresh or isinstance(error, OverLimitError) or how.endswith("SIGXCPU"):
                    break
            except BaseException:
                reader.kill()
                reader.close()
                raise
            else:
                _idle.append(reader)
                if isinstance(answer, DataError):
                    raise answer
                return answer
            finally:
                _running.discard(reader)
        if isinstance(died, OverLimitError):
            text = f"could not be read within {WAITING * computing_s} s; its disk may not answer. Try again, or copy it"
        elif how.endswith("SIGXCPU"):
            text = f"reading it took more than {computing_s} s of computing time. The file is damaged; copy it again"
        else:
            text = f"the process that reads it ended ({how}). Copy the file again; see also: srbval doctor"
        raise DataError(f"{path}: {text}")


@atexit.register
def end_readers() -> None:
    """End all child processes of this program that read a file or wait for the next one."""
    while _running:
        _running.pop().kill()
    while _idle:
        _idle.pop().close()
