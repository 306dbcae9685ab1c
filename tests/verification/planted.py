"""A process that runs checks on kernels with an error planted in them, one error after the other.

``python -m tests.verification.planted`` reads planted errors from its input, one JSON object a line with the tests to
run, and answers each with a line: pytest's exit status and what it printed. Each is planted in a child that is forked
off before any kernel is imported, so that what everything needs is imported only once and no copy of the package is
made.
"""

import importlib
import json
import os
import signal
import sys
import tempfile
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import Any

import pytest

import srbval

KERNELS = Path(srbval.__file__).parent / "models" / "full"
LONGEST_S = 600
NEEDED = ("numba", "numpy.testing", "scipy.optimize", "scipy.signal", "scipy.fft", "scipy.spatial.transform")
# Nothing of the project's own settings: checks are run as they stand, and warnings are no matter here.
OPTIONS = "-x -q --tb=no -rf -p no:cacheprovider -p no:xdist -o addopts= -o filterwarnings= --timeout=0"


def plant(error: dict[str, str]) -> None:
    """Have a kernel file read with `old` replaced by `new`, and not from what was compiled of it before."""
    planted = str(KERNELS / error["file"])
    path_stats, get_data = SourceFileLoader.path_stats, SourceFileLoader.get_data

    def stats(loader: SourceFileLoader, path: Any) -> Any:
        if path == planted:
            raise OSError("not to be taken from a cache")
        return path_stats(loader, path)

    def data(loader: SourceFileLoader, path: Any) -> bytes:
        found = get_data(loader, path)
        return found.replace(error["old"].encode(), error["new"].encode()) if path == planted else found

    SourceFileLoader.path_stats, SourceFileLoader.get_data = stats, data


def main() -> None:
    """Answer until the input ends."""
    for name in NEEDED:
        importlib.import_module(name)
    assert not any(name.startswith("srbval.models") for name in sys.modules)
    for line in sys.stdin:
        error = json.loads(line)
        with tempfile.TemporaryFile() as printed:
            child = os.fork()
            if child == 0:
                signal.alarm(LONGEST_S)
                os.dup2(printed.fileno(), 1)
                os.dup2(printed.fileno(), 2)
                plant(error)
                code = int(pytest.main([*OPTIONS.split(), *error["tests"]]))
                sys.stdout.flush()
                os._exit(code)
            _, status = os.waitpid(child, 0)
            printed.seek(0)
            text = printed.read().decode(errors="replace")
        print(json.dumps([os.waitstatus_to_exitcode(status), text]), flush=True)


if __name__ == "__main__":
    main()
