"""Cores under the quota of a container; commands where nothing of POSIX exists."""

import os
import subprocess
import sys

import pytest

from srbval.processes import machine

COUNTS = ("sched_getaffinity", "cpu_count")


@pytest.mark.parametrize(
    ("groups", "files", "cores"),
    [
        ("0::/", {"cpu.max": "max 100000"}, 8),
        ("0::/a/b", {"a/b/cpu.max": "max 100000", "a/cpu.max": "150000 100000"}, 2),  # of the group above
        ("0::/path/of/host", {"cpu.max": "50000 100000"}, 1),  # as a container sees itself
        (None, {"cpu.max": "100000 100000"}, 8),
    ],
)
@pytest.mark.parametrize("call", COUNTS)
def test_no_more_cores_than_a_quota_pays_for(call, groups, files, cores, tmp_path, monkeypatch):
    for name in COUNTS:
        monkeypatch.delattr(os, name, raising=False)
    monkeypatch.setattr(os, call, lambda *_: range(8) if call == "sched_getaffinity" else 8, raising=False)
    monkeypatch.setattr(machine, "GROUPS", tmp_path)
    monkeypatch.setattr(machine, "OWN_GROUPS", tmp_path / "groups")
    for name, text in (files | ({"groups": groups} if groups else {})).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"{text}\n", encoding="utf-8")
    assert machine.usable_cores() == cores


WITHOUT = """
import asyncio  # newer versions ask `os.sysconf` when imported, because sockets here have `sendmsg`, unlike on Windows
import io, os, select, signal, sys

groups = "fork forkpty getloadavg getpgrp killpg sched_getaffinity sysconf"
for module, names in ((os, groups), (signal, "SIGHUP pthread_kill pthread_sigmask"), (select, "epoll poll")):
    for name in names.split():
        vars(module).pop(name, None)
sys.modules["resource"] = None
opened, listed = io.open, os.listdir
io.open = lambda path, *more, **named: opened("/none" if str(path).startswith("/proc/") else path, *more, **named)
os.listdir = lambda path=".": listed("/none" if str(path).startswith("/proc/") else path)
"""
CAMPAIGN = """name = "c"
outputs = ["summary"]
[scene]
model = "kinematic"
duration = "1 s"
[[axes]]
kind = "grid"
values = { shaft_speed = ["700 rpm", "800 rpm"] }
"""
COMMANDS = (
    "simulate --model kinematic --defect outer --seconds 2 -o run.h5",
    "analyse run.h5",
    "analyse record.csv --fs 10000 --unit g --rpm 710 --bearing skf-22240",
    "campaign run c.toml -o campaign --jobs 2",
)


def test_commands_need_nothing_of_posix(tmp_path):
    """Child processes, which read files and run cases, lack it too."""
    (tmp_path / "sitecustomize.py").write_text(WITHOUT, encoding="utf-8")
    (tmp_path / "c.toml").write_text(CAMPAIGN, encoding="utf-8")
    (tmp_path / "record.csv").write_text("".join(f"{n * n % 7919}\n" for n in range(20_000)), encoding="utf-8")
    code = "import sys, shlex; from srbval.cli import run_command_line as run; "
    code += "print([run(shlex.split(c)) for c in sys.argv[1:]])"
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    own = {"env": os.environ | {"PYTHONPATH": paths}, "cwd": tmp_path, "encoding": "utf-8"}
    done = subprocess.run([sys.executable, "-c", code, *COMMANDS], capture_output=True, text=True, **own)
    assert done.stdout.splitlines()[-1] == "[0, 0, 0, 0]", done.stderr
