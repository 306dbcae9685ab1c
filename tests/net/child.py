"""One command of a checkout's ``srbval`` in a child process, and its output without what differs from run to run."""

import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import platformdirs

RECORDINGS_VARIABLE = "SRBVAL_RECORDINGS"
LONGEST_S = 3600  # of one command
# Lines of progress on standard error.
PROGRESS = re.compile(r".* \.\.\.|.*: done in [\d.]+ s|.*:( \d+ %)? after [\d.]+ (s|min|h)(, about .* to go)?")
PATTERNS = (
    (re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?(Z|[+-]\d\d:\d\d)?"), "<time>"),
    (re.compile(r"\b[0-9a-f]{40}\b"), "<revision>"),
    (re.compile(r"\b[0-9a-f]{32}\b"), "<key>"),  # of a result, which goes with the version of the code
    (re.compile(r"\bsrbval \d+\.\d+\.\d+\S*"), "srbval <version>"),
    (re.compile(r"srbval-error-\w+\.txt"), "srbval-error-<random>.txt"),
    (re.compile(r"0x[0-9a-f]{6,}"), "<address>"),
    (re.compile(r"(slowest run here took) [\d.,]+"), r"\1 <time>"),
    (re.compile(r"saves -?\d+ % of the time"), "saves <time>"),
)


@dataclass(frozen=True)
class Checkout:
    """A checkout under test, and a scratch folder in which its commands run.

    Cache (stored results, fonts), register of recordings and temporary files are in the scratch folder: nothing that
    an earlier run has stored can stand in for what is computed now. The compiled kernels alone are shared with ordinary
    use: srbval names their folder by the content of the kernels' sources.
    """

    folder: Path
    scratch: Path

    def run(self, *words: str | Path) -> dict[str, Any]:
        """Exit code and output of one command, comparable: standard output as JSON where it is that, else lines."""
        command = [sys.executable, "-m", "srbval", *map(str, words)]
        ended = subprocess.run(
            command, cwd=self.scratch, env=self._environment(), stdin=subprocess.DEVNULL, capture_output=True,
            text=True, encoding="utf-8", errors="backslashreplace", timeout=LONGEST_S, check=False,
        )  # fmt: skip
        messages = [line for line in ended.stderr.splitlines() if not PROGRESS.fullmatch(line.strip())]
        return {"code": ended.returncode, "out": self._parsed(ended.stdout), "messages": self.comparable(messages)}

    def check_import(self) -> None:
        """Refuse to go on where a child process imports another srbval than the checkout's."""
        code = "import srbval; print(srbval.__file__)"
        told = subprocess.run([sys.executable, "-c", code], cwd=self.scratch, env=self._environment(),
                              capture_output=True, text=True, check=True).stdout.strip()  # fmt: skip
        if not Path(told).is_relative_to(self.folder):
            raise SystemExit(f"{told} is imported, which is not in {self.folder}")

    def comparable(self, value: Any) -> Any:
        """`value` with its texts without paths of this machine, times and versions."""
        if isinstance(value, dict):
            return {key: self.comparable(inner) for key, inner in value.items()}
        if isinstance(value, list):
            return [self.comparable(inner) for inner in value]
        return self._plain(value) if isinstance(value, str) else value

    def _plain(self, text: str) -> str:
        places = {str(self.scratch): "<scratch>", str(self.folder): "<checkout>", sys.executable: "<python>"}
        recordings = os.environ.get(RECORDINGS_VARIABLE)
        for place, name in (places | ({str(Path(recordings)): "<recordings>"} if recordings else {})).items():
            text = text.replace(place, name)
        for pattern, name in (*PATTERNS, *_own_revision(self.folder)):
            text = pattern.sub(name, text)
        return text

    def _parsed(self, text: str) -> Any:
        try:
            return self.comparable(json.loads(text))
        except ValueError:
            return self.comparable(text.splitlines())

    def _environment(self) -> dict[str, str]:
        kernels = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("srbval")
        own = {name: self.scratch / folder for name, folder in (
            ("XDG_CACHE_HOME", "cache"), ("XDG_DATA_HOME", "data"), ("SRBVAL_HOME", "home"), ("TMPDIR", "tmp")
        )}  # fmt: skip
        for folder in own.values():
            folder.mkdir(exist_ok=True)
        fixed = {"PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": kernels,
                 "COLUMNS": "80", "NO_COLOR": "1", "LC_ALL": "C.UTF-8", "MPLBACKEND": "Agg"}  # fmt: skip
        return os.environ | fixed | {name: str(folder) for name, folder in own.items()}


@cache
def _own_revision(folder: Path) -> list[tuple[re.Pattern[str], str]]:
    """What replaces the revision of a checkout, of which a report names the first digits; nothing without git."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        words = ["git", "-C", str(folder), "rev-parse", "HEAD"]
        head = subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
        return [(re.compile(rf"\b{head[:7]}[0-9a-f]*(-dirty)?"), "<revision>")]
    return []


def recordings_folder() -> Path:
    """The folder of recordings that SRBVAL_RECORDINGS names."""
    named = os.environ.get(RECORDINGS_VARIABLE)
    if not named or not Path(named).is_dir():
        raise SystemExit(f"set {RECORDINGS_VARIABLE} to the folder of the recordings")
    return Path(named)


def scratch_folder() -> tempfile.TemporaryDirectory[str]:
    """A temporary folder, deleted at the end of the `with` statement."""
    return tempfile.TemporaryDirectory(prefix="srbval-net-")


def with_json(words: Sequence[str]) -> list[str]:
    """A command with ``--json`` after its verb."""
    return [words[0], "--json", *words[1:]]
