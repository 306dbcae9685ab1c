"""Child process that loads one file after another: ``python -m srbval.recordings.loaders.reader_process``."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import limit_memory, limit_resource
from srbval.processes.worker import serve_calls
from srbval.recordings.loaders import FileFormat
from srbval.recordings.raw import RawFile, first_line
from srbval.storage.installation import import_library

Request = tuple[FileFormat, Path, str | None, int, int]  # folder, computing time [s] and memory [bytes]


def prepare_worker() -> Callable[[Request], RawFile | DataError]:
    """Discard the output of libraries, disable core dumps, and return the function that loads a file."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    limit_resource("RLIMIT_CORE", 0)
    return _load_within_limits


def _load_within_limits(request: Request) -> RawFile | DataError:
    """Load a file with limited computing time and memory; return a `DataError` if this fails."""
    form, path, folder, computing_s, memory = request
    if form.library is not None:
        module, name = form.library
        try:
            import_library(module, f"{path}: reading it", name)
        except (ConfigurationError, OSError) as error:  # OSError: a shared library is missing
            return DataError(str(error))
    limit_resource("RLIMIT_CPU", int(time.process_time()) + 1 + computing_s)
    limit_memory(memory)
    try:
        if folder is not None:
            os.chdir(folder)
        return form.read(path)
    except DataError as error:
        return error
    except MemoryError:
        return DataError(f"{path}: reading it took more than {memory} bytes of memory. It is damaged; copy it again.")
    except (FileNotFoundError, PermissionError) as error:
        return DataError(f"{path}: cannot be read ({error.strerror or error}).")
    except Exception as error:  # a damaged file may raise anything in a library
        return DataError(f"{path}: truncated or damaged ({form.name}: {first_line(error)}). Copy it again.")


if __name__ == "__main__":
    serve_calls(prepare_worker)
