"""Whatever goes wrong: one line on standard error, JSON where asked for, a documented exit code, never a traceback."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import srbval.cli
from srbval.cli import INTERNAL, main
from srbval.errors import NumericsError, SrbvalError

LONGEST = SrbvalError.longest + 30
SRBVAL = [sys.executable, "-c", "import sys, srbval.cli; sys.exit(srbval.cli.main())"]


def one_line(text: str) -> str:
    """The last line, which is the message; no more than one, and nothing of a traceback."""
    assert "Traceback" not in text
    lines = [line for line in text.splitlines() if line.startswith("srbval: ")]
    assert len(lines) == 1, text
    assert len(lines[0]) < LONGEST
    assert lines[0].isprintable()
    return lines[0]


class Odd(Exception):
    def __str__(self) -> str:
        return "two\nlines \x1b[2J" + "x" * 10_000


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (MemoryError(), INTERNAL),
        (Odd(), INTERNAL),
        (UnicodeEncodeError("ascii", "\udcff", 0, 1, "no"), INTERNAL),
        (NumericsError("why"), 4),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 3),  # a worker's: the command's own output still has a reader
        (KeyboardInterrupt(), 130),
        (OSError(errno.ENOSPC, "No space left on device"), 3),
        (PermissionError(errno.EACCES, "no", "/a\nb"), 3),
    ],
)
@pytest.mark.parametrize("as_json", [True, False])
@pytest.mark.usefixtures("no_alarm")
def test_any_error_is_one_line(error, code, as_json, capfd, monkeypatch, tmp_path):
    def fail(*_: Any) -> None:
        raise error

    monkeypatch.setattr("srbval.cli.bearing_commands.load_bearing", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert main(["kinematics", *(["--json"] if as_json else [])]) == code
    said = capfd.readouterr()
    line = one_line(said.err)
    if as_json:
        found = json.loads(said.out)
        assert (found["status"], found["exit_code"]) == ("failed", code)
    reports = list(tmp_path.iterdir())
    assert len(reports) == (code == INTERNAL)
    for report in reports:
        assert str(report) in line
        assert "Traceback" in report.read_text()
        assert type(error).__name__ in line


@pytest.fixture
def no_alarm(_bugs_are_seen, monkeypatch):
    """The suite lets errors that nobody expected through (see ``conftest.py``); not here."""
    monkeypatch.setattr(srbval.cli, "internal_error", INTERNAL_ERROR)


INTERNAL_ERROR = srbval.cli.internal_error


STREAMS = {
    "full, JSON": ("kinematics --json > /dev/full", 3, True),
    "full, help": ("--help > /dev/full", 0, False),
    "full stderr": ("kinematics --bearing x 2> /dev/full", 2, False),
    "closed, to a file": ("simulate --seconds 0.001 --model kinematic -o run.h5 >&-", 0, False),
    "all closed": ("kinematics --bearing x --json >&- 2>&- <&-", 2, False),
    "head": ("data list | true; exit ${PIPESTATUS[0]}", 0, False),
}


@pytest.mark.parametrize("what", STREAMS)
def test_streams_that_take_nothing(what, tmp_path):
    command, code, said = STREAMS[what]
    program = f'"{sys.executable}" -c "import sys, srbval.cli; sys.exit(srbval.cli.main())" "$@"'
    script = f"srbval() {{ {program}; }}; srbval {command}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    if said:
        one_line(done.stderr)
    if "run.h5" in command:
        assert (tmp_path / "run.h5").read_bytes()[1:4] == b"HDF"


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_names_that_cannot_be_written(encoding, tmp_path):
    """JSON stays JSON, whatever the terminal's encoding and the names of the files."""
    name = os.fsdecode("µ\U0001f600".encode() + b"\xff.csv")
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / name).write_text("1.5,2\n2.5,1\n" * 200)
    env = os.environ | {"PYTHONIOENCODING": encoding, "SRBVAL_HOME": str(tmp_path / "home")}
    for arguments in (["data", "add", str(tmp_path / "rig")], ["data", "list", "--json"]):
        done = subprocess.run([*SRBVAL, *arguments], capture_output=True, env=env)
        assert b"Traceback" not in done.stderr
        assert done.returncode in (0, 1, 3), done.stderr
    found = json.loads(done.stdout.decode(encoding))
    assert [Path(r["file"]).name for r in found["recordings"]] == [name], found
