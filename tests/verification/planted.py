"""A process that runs checks on kernels with an error planted in them, one error after the other.

``python -m tests.verification.planted CHECK ...`` reads planted errors from its input, one JSON object a line, and
answers each with a line: pytest's exit status and what it printed. Each is planted in a child that is forked off before
any kernel is imported, so that what everything needs is imported only once and no copy of the package is made.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import pytest

import srbval

KERNELS = Path(srbval.__file__).parent / "models" / "full"
LONGEST_S = 600
NEEDED = ("numba", "numpy.testing", "scipy.optimize", "scipy.signal", "scipy.fft", "scipy.spatial.transform")
# Nothing of the project's own settings: checks are run as they stand, and warnings are no matter here.
OPTIONS = ("-x", "-q", "--tb=no", "-rf", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "addopts=",
           "-o", "filterwarnings=", "--timeout=0")  # fmt: skip


class PlantingLoader(importlib.machinery.SourceFileLoader):
    """Loads a kernel file with `old` replaced by `new`."""

    def __init__(self, name: str, path: str, old: str, new: str) -> None:
        super().__init__(name, path)
        self.old, self.new = old, new

    def get_code(self, fullname: str) -> object:
        """Compile what the file says, but for the error; nothing of it is cached."""
        source = Path(self.path).read_text(encoding="utf-8")
        if self.old:
            assert source.count(self.old) == 1, f"{self.old!r} in {self.path}"
            source = source.replace(self.old, self.new)
        return compile(source, self.path, "exec", dont_inherit=True)


class Planting(importlib.abc.MetaPathFinder):
    """Finds the kernel file in which an error is to be planted."""

    def __init__(self, file: str, old: str, new: str) -> None:
        self.name = f"srbval.models.full.{Path(file).stem}"
        self.change = (str(KERNELS / file), old, new)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The specification of that one module; None for any other."""
        if fullname != self.name:
            return None
        place, old, new = self.change
        return importlib.util.spec_from_file_location(
            fullname, place, loader=PlantingLoader(fullname, place, old, new)
        )


def run_checks(error: dict[str, str], checks: list[str]) -> None:
    """In the child: plant the error and run the checks up to the first failure. Does not return."""
    signal.alarm(LONGEST_S)
    sys.meta_path.insert(0, Planting(error["file"], error["old"], error["new"]))
    code = int(pytest.main([*OPTIONS, *sorted(checks, key=lambda check: not check.endswith(error["first"]))]))
    sys.stdout.flush()
    os._exit(code)


def main(checks: list[str]) -> None:
    """Answer until the input ends."""
    for name in NEEDED:
        importlib.import_module(name)
    assert not any(name.startswith("srbval.models") for name in sys.modules)
    for line in sys.stdin:
        with tempfile.TemporaryFile() as printed:
            child = os.fork()
            if child == 0:
                os.dup2(printed.fileno(), 1)
                os.dup2(printed.fileno(), 2)
                run_checks(json.loads(line), checks)
            _, status = os.waitpid(child, 0)
            printed.seek(0)
            text = printed.read().decode(errors="replace")
        print(json.dumps([os.waitstatus_to_exitcode(status), text]), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
