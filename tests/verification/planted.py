"""Runs tests on kernels with an error planted in them, each error in a process of its own.

Processes are forked by a server that has imported what all of them need, but none of the package's models: no copy of
the package is made, and the kernels run uncompiled.
"""

import contextlib
import io
import os
from importlib.machinery import SourceFileLoader
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path
from typing import Any

import numba
import pytest

import srbval

KERNELS = Path(srbval.__file__).parent / "models" / "full"
NEEDED = ["numba", "pytest", "scipy.optimize", "scipy.signal", "scipy.fft", "scipy.spatial.transform"]
# Nothing of the project's own settings: checks are run as they stand, and warnings are no matter here. No plugin and no
# rewriting of assertions: loading them takes longer than a test.
OPTIONS = "-x -q --tb=no -rf -p no:cacheprovider --noconftest --assert=plain -o addopts= -o filterwarnings="


def processes(count: int) -> Pool:
    """Processes that run one task each."""
    context = get_context("forkserver")
    context.set_forkserver_preload(NEEDED)
    return context.Pool(count, maxtasksperchild=1)


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
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    numba.config.reload_config()


def run_tests(error: dict[str, str], tests: list[str]) -> tuple[int, str]:
    """Exit status of pytest with the error planted, and what it printed."""
    plant(error)
    with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.redirect_stderr(printed):
        code = int(pytest.main([*OPTIONS.split(), *tests]))
    return code, printed.getvalue()
