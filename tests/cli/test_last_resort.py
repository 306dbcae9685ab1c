"""Whatever goes wrong: one line on standard error, JSON where asked for, a documented exit code, never a traceback."""

import errno
import importlib.util
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.resources import files
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
    [(MemoryError(), INTERNAL), (RecursionError("too deep"), INTERNAL), (Odd(), INTERNAL), (KeyError("a"), INTERNAL),
     (UnicodeEncodeError("ascii", "\udcff", 0, 1, "no"), INTERNAL), (NumericsError("why"), 4),
     (BrokenPipeError(errno.EPIPE, "Broken pipe"), 3),  # a worker's: the command's own output still has a reader
     (KeyboardInterrupt(), 130), (OSError(errno.ENOSPC, "No space left on device"), 3),
     (PermissionError(errno.EACCES, "no", "/a\nb"), 3)],
)  # fmt: skip
@pytest.mark.parametrize("as_json", [True, False])
@pytest.mark.usefixtures("no_alarm")
def test_any_error_is_one_line(
    error: BaseException, code: int, as_json: bool, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:  # fmt: skip
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
def no_alarm(_bugs_are_seen: None, monkeypatch: pytest.MonkeyPatch) -> None:
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
def test_streams_that_take_nothing(what: str, tmp_path: Path) -> None:
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
def test_names_that_cannot_be_written(encoding: str, tmp_path: Path) -> None:
    """JSON stays JSON, whatever the terminal's encoding and the names of the files."""
    name = os.fsdecode("µ\U0001f600".encode() + b"\xff.csv")
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / name).write_text("1,2\n" * 10)
    env = os.environ | {"PYTHONIOENCODING": encoding, "SRBVAL_HOME": str(tmp_path / "home")}
    for arguments in (["data", "add", str(tmp_path / "rig")], ["data", "list", "--json"]):
        done = subprocess.run([*SRBVAL, *arguments], capture_output=True, env=env)
        assert b"Traceback" not in done.stderr
        assert done.returncode in (0, 1, 3), done.stderr
    found = json.loads(done.stdout.decode(encoding))
    assert [Path(r["file"]).name for r in found["recordings"]] == [name], found


COMMANDS = tomllib.loads((files("srbval.cli") / "commands.toml").read_text(encoding="utf-8"))
NUMBERS = ["nan", "inf", "-inf", "-1", "0", "-0.0", "1e-320", "1e308", "1e400", "1e12", "9" * 400, "9" * 5000, "0x10",
           "", " ", "\0", "\ud800", "٣", "1" * 1_000_000, "1e-13"]  # fmt: skip
TEXTS = ["", " ", "\0", "\ud800", "\udcff", "a\nb", "x" * 1_000_000, "/dev/zero", "/dev/full", "/", ".", "-1", "a/b/c",
         "no.toml", "//[", "/proc/self/mem", "http://[", "CON", "~", "*"]  # fmt: skip
# What would take long; everything before it is run as it is.
LONG = {
    "simulate": ["srbval.cli.scene_commands.simulate", "srbval.cli.scene_commands.simulate_to_file"],
    "report": ["srbval.report.reports.gather"],
    "campaign": ["srbval.cli.campaign_command.run_campaign"],
    "check": ["srbval.cli.check_command.run_check"],
    "data": ["srbval.cli.data_command.fetch"],
    "doctor": ["srbval.cli.installation_commands.clear_cache"],
    "docs": ["sphinx.cmd.build.build_main"],
}  # fmt: skip
NEEDED = {"campaign run": ["table5-smoke", "--dry-run"], "campaign status": ["folder"], "campaign verify": ["folder"],
          "campaign export": ["folder", "-o", "out.h5"], "analyse": ["run.csv"], "data add": ["folder"],
          "data fetch": ["torino-excerpts"]}  # fmt: skip


def options() -> Iterator[tuple[list[str], str, dict[str, Any]]]:
    """Every option and argument of every command and action, those that several share once: words, name, settings."""
    seen: set[str] = set()
    for command, about in COMMANDS["commands"].items():
        for action, table in about.get("actions", {"": about}).items():
            words = [command, action] if action else [command]
            tables = [COMMANDS["groups"][group] for group in table.get("groups", ()) if group not in seen]
            seen |= set(table.get("groups", ()))
            for arguments in (*tables, table.get("arguments", {})):
                for name, settings in arguments.items():
                    yield words, name.split()[-1], settings


OPTIONS = {
    " ".join([*words, name]): (words, name, settings) for words, name, settings in options() if "action" not in settings
}
EVERY = 4  # of the hostile values an option gets every fourth: each of them meets dozens of options


@pytest.mark.timeout(300)
@pytest.mark.parametrize("option", OPTIONS)
def test_every_option_with_hostile_values(
    option: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    words, name, settings = OPTIONS[option]

    def guarded(*_: Any, **__: Any) -> None:
        raise NumericsError("this would take long")

    for place in LONG.get(words[0], ()):
        if importlib.util.find_spec(place.split(".")[0]):  # Sphinx is an extra
            monkeypatch.setattr(place, guarded)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "run.csv").write_text("1,2\n2,3\n" * 1000)
    numbers, count = "type" in settings, settings.get("nargs") if isinstance(settings.get("nargs"), int) else 1
    needed = NEEDED.get(" ".join(words), [])
    for value in (NUMBERS if numbers else TEXTS)[list(OPTIONS).index(option) % EVERY :: EVERY]:
        if option == "data add folder" and value == "/":
            continue  # legal, and long
        given = [f"{name}={value}"] if name.startswith("-") and count == 1 else [name, *[value] * (count or 1)]
        arguments = [*words, *(needed if name.startswith("-") else []), *(given if name.startswith("-") else given[1:])]
        code = main([*arguments, "--json"])
        said = capfd.readouterr()
        assert code in (0, 1, 2, 3, 4), (code, value[:100], said.err[-2000:])
        assert "Traceback" not in said.err
        document = json.loads(said.out)
        assert (document["status"] == "failed") == (code >= 2), document
        if code >= 2:
            one_line(said.err)
