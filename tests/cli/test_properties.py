"""Every command with any options: no traceback; exit code, JSON and text agree.

Commands and options are the parser's own, so a new one is tested without being named here. `SRBVAL_PROPERTIES` is the
number of random examples in all, 300 by default.
"""

import argparse
import contextlib
import functools
import importlib
import io
import json
import math
import os
import random
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.cli import arguments, output, run_command_line
from srbval.errors import NumericsError, SrbvalError
from srbval.models.hierarchy import LEVELS
from srbval.models.run import USABLE, RunStatus
from srbval.models.solvers import METHODS
from srbval.plan.questions import Question
from srbval.scene import paper_scene
from srbval.storage.installation import cache_use
from srbval.studies.harness import study_names
from tests.campaign.campaigns import run_small, small

EXAMPLES = int(os.environ.get("SRBVAL_PROPERTIES", "300"))
GIVEN = 8  # an option that may be left out is given once in so many examples, those of `OFTEN` but once
FS_HZ, SECONDS = 12_000, 1.0  # of the records
LONGEST = SrbvalError.longest + 30

LONG = (  # functions that take long, or change this machine; everything before them runs as it is
    *(f"srbval.cli.{name}" for name in ("campaign_command.run_campaign", "study_commands.run_check")),
    *("srbval.cli.data_command.fetch", "srbval.storage.installation.clear_cache"),
    *(f"srbval.cli.study_commands.{name}" for name in ("make_result", "fingerprint", "recompute")),
    *(f"srbval.cli.study_commands.{name}" for name in ("bench", "stability", "measure_scale")),
    "srbval.path.identify.simulated_run",
    *(f"srbval.report.{name}" for name in ("reports.gather", "findings.user_records.run_counterpart")),
)
OFTEN = ("bearing", "rpm", "fs", "unit", "band")  # without which few records can be analysed
SHARES = {"kinematics": 150, "simulate": 60, "plan": 150, "report": 6, "bearing list": 10, "analyse": 60}
OTHERS = 30  # examples of each other command, of 1,000 in all
ALWAYS = {"simulate": "duration_s model", "report": "files", "data add": "folder"}
RECORDS = "record.csv record.csv record.csv healthy.npy tacho.npz run.h5 text.csv nowhere.csv"
CHEAP = "kinematic kinematic kinematic impulse impulse planar"
# Words of an option by its name, its metavar or its type.
WORDS: dict[str, Sequence[str]] = {
    key: words.split()
    for key, _, words in (
        line.partition(": ")
        for line in f"""\
B: skf-22240 own.toml own.toml skf-6205 mfpt-nice fag-22205 skf-22241
FILE: {RECORDS}
file: {RECORDS}
healthy: {RECORDS}
FILE|DIR: {RECORDS} records
FILE.toml: machine.toml machine.toml own.toml
OUT.csv|xlsx: out.csv
OUT.html: out.html
TABLE.csv: records/labels.csv
CLASS: large-rigid x
SCENE: paper rig scene.toml
P: none rig path.toml
none|outer|inner|roller: none outer inner roller ball
N1..N12: N1 N2 N5 N12
model: {CHEAP} {" ".join(level.name for level in LEVELS)} auto
solver.name: {" ".join(METHODS)}
Q: {" ".join(Question)}
C: acc tacho 2
U: g g m/s2 m/s² mg
E: local local slurm
cluster_class: distributed.Nothing queue.Queue none
KEY=VALUE: memory=8GB measured.channel=acc x
FOLDER: records record.csv
DIR: done done done damaged out
LABELS.csv: records/labels.csv
FILE.toml|PRESET: campaign.toml table5-smoke
NAME: {" ".join(study_names())} torino-excerpts
output: out.h5 out.toml out
OUT.png|svg|html: out.png out.svg out.html out.gif
URL: tcp://127.0.0.1:1
TEXT: 222 skf zzz
KIND: kernels nothing
FILE|DIR|NAME: records records/b.npy nowhere.csv
rpm: 1500 1500 1500 100 1797 6000
duration_s: 0.02 0.1 0.3
fs: 12000 12000 6000
pulses_per_rev: 1 2 60
band: 100 500 1000 2000 3000 5999
cage_slip: 0.1 1 6
rpm_tolerance: 0.1 1 12
mm: 0.01 0.3 1.1
step: auto 1/61440 1e-5 4.069010416666667e-06 2e-5
tolerance: 1e-3 0.5 10 100 3dB 1dB
positive: 0.01 0.3 4 100 1000
finite: 0.01 0.3 4 100 1000 -2
kN: 0.01 0.3 4 100 1000 -2
elements: 9,7.94,39.04,0 19,40.1,283.62,10 9,7.94
orders: 8.177,10.823,3.468,0.4304 8,10,3,0.4
count: 1 5 20 50
jobs: 1 2 3
seed: 0 7 99""".splitlines()
    )
}


def leaves(of: argparse.ArgumentParser, words: tuple[str, ...] = ()) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """The commands, or their actions, with their parsers."""
    inner = [action for action in of._actions if isinstance(action, argparse._SubParsersAction)]
    for action in inner:
        for name, parser in action.choices.items():
            yield from leaves(parser, (*words, name))
    if not inner:
        yield " ".join(words), of


TYPE_NAMES = {kind: name for name, kind in arguments.ARGUMENT_TYPES.items()}
COMMANDS = dict(leaves(arguments.build_parser()))


def options_of(command: str) -> list[argparse.Action]:
    return [a for a in COMMANDS[command]._actions if a.dest not in ("help", "json")]


def values_of(action: argparse.Action) -> list[str]:
    if action.choices:
        return list(map(str, action.choices))
    metavar = action.metavar if isinstance(action.metavar, str) else ""
    for key in (action.dest, metavar, TYPE_NAMES.get(action.type)):
        if key in WORDS:
            return list(WORDS[key])
    return [word for words in WORDS.values() for word in words]


def put(action: argparse.Action, values: Sequence[str]) -> list[str]:
    """The words of an option with its values; behind an equals sign, as they may begin with a minus."""
    if not action.option_strings:
        return list(values)
    name = action.option_strings[-1]
    return [f"{name}={values[0]}"] if len(values) == 1 else [name, *values]


def command_line(chance: random.Random, command: str) -> list[str]:
    """A command with some of its options, at random."""
    line, left_out = command.split(), set[argparse.Action]()
    for action in options_of(command):
        if action in left_out:  # another one of its group was given
            continue
        must = action.required or action.dest in ALWAYS.get(command, "").split()
        often = GIVEN - 1 if action.dest in OFTEN else 1
        if not must and chance.randrange(GIVEN) >= often:
            continue
        several = action.nargs in ("*", "+") and chance.random() < 0.5
        count = action.nargs if isinstance(action.nargs, int) else 1 + several
        values = [chance.choice(values_of(action)) for _ in range(count)]
        line += put(action, sorted(values, key=float) if action.dest == "band" else values)
        for group in COMMANDS[command]._mutually_exclusive_groups:
            left_out |= set(group._group_actions) if action in group._group_actions else set()
    return line


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """Lines that the last command would have printed without --json, in a folder with the files that `WORDS` names.

    What takes long fails there.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("place"))
        text, cache = list[str](), cache_use()  # the files of the cache are many
        patch.setenv("SRBVAL_HOME", str(Path("home").absolute()))
        write_files()
        patch.setattr(arguments, "build_parser", functools.cache(arguments.build_parser))

        def guarded(*_: Any, **__: Any) -> None:
            raise NumericsError("this would take long")

        patch.setattr("srbval.storage.installation.cache_use", lambda: cache)
        if os.environ.get("SRBVAL_TESTS") != "all":  # `doctor --warm` would take minutes
            patch.setattr("srbval.models.simulate.scenes_of_all_kernels", lambda: [paper_scene(model="planar")])
        for path in Path(arguments.__file__).parent.glob("*_command*.py"):
            patch.setattr(f"srbval.cli.{path.stem}.print_result", functools.partial(answer_twice, text))
        for function in LONG:
            module, _, name = function.rpartition(".")  # some rooms have the name of a function of the package
            patch.setattr(importlib.import_module(module), name, guarded)
        yield text


@pytest.fixture(autouse=True)
def _one_register(_own_home, said, monkeypatch):  # noqa: ARG001
    """All examples share a register, in which the first have left what others find."""
    monkeypatch.setenv("SRBVAL_HOME", str(Path("home").absolute()))


def answer_twice(text: list[str], options: argparse.Namespace, document: Any, show: Any, **more: Any) -> int:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        output.print_result(argparse.Namespace(json=False, export=None), document, show, **more)
    text[:] = printed.getvalue().splitlines()
    return output.print_result(options, document, show, **more)


def write_files() -> None:
    rng, time = np.random.default_rng(1), np.arange(int(SECONDS * FS_HZ)) / FS_HZ
    since = np.mod(time, 1 / 89.6)  # BPFO of the bearing below at 25 Hz
    samples = rng.normal(0, 0.05, time.size) + np.exp(-900 * since) * np.sin(2 * np.pi * 3000 * since)
    np.savetxt("record.csv", samples, header="acc [g]", comments="", fmt="%.5f")
    np.save("healthy.npy", rng.normal(0, 0.05, time.size))
    np.savez("tacho.npz", acc=samples, tacho=np.mod(time * 25.0, 1) < 0.5, fs=float(FS_HZ))
    Path("text.csv").write_text("no number\n")
    Path("own.toml").write_text(
        'title = "b"\nsource = "s"\n[elements]\nrolling_elements = 9\nelement_diameter = "0.3126 in"\n'
        'pitch_diameter = "1.537 in"\ncontact_angle = "0 deg"\n'
    )
    Path("machine.toml").write_text('title = "m"\nbearing = "own.toml"\nrpm = 1500\n')
    Path("scene.toml").write_text(
        'duration = "0.1 s"\nsettle = "0 s"\n[speed_profile]\ntime = ["0 s", "1 s"]\nspeed = ["800 rpm", "900 rpm"]\n'
    )
    Path("path.toml").write_bytes((Path(arguments.__file__).parents[1] / "scene" / "sensor_path_rig.toml").read_bytes())
    Path("campaign.toml").write_text(
        'name = "c"\n[scene]\nduration = "5 ms"\nmodel = "planar"\n[[axes]]\nkind = "grid"\n'
        'values = { "load.radial" = ["1 kN", "-1 kN"], "defect.kind" = ["none", "outer"] }\n'
    )
    Path("records").mkdir()
    os.mkfifo("pipe")
    Path("loop").symlink_to("loop")
    for name in ("a", "b"):
        np.save(f"records/{name}.npy", rng.normal(size=2000))
    Path("records/labels.csv").write_text("file,state,rpm\na.npy,healthy,1500\n")
    assert run_command_line(["data", "add", "records"]) == 0
    Path("records/b.npy").write_bytes(Path("records/a.npy").read_bytes())  # is now another one
    command = ["simulate", "--model=kinematic", "--seconds=1", "--defect=outer", "-o", "run.h5"]
    assert run_command_line(command) == 0
    run_small(small(), Path("done"))
    shutil.copytree("done", "damaged")
    next(Path("damaged").rglob("*.h5")).write_bytes(b"no result")


def answered(line: Sequence[str], said: list[str]) -> tuple[int, dict[str, Any], list[str]]:
    """Exit code, JSON and text of a command line; every one of them is as `interface` says, whatever the line."""
    said.clear()
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command_line([*line, "--json"])
    shown = [word[:100] for word in line]
    assert "Traceback" not in err.getvalue(), shown
    document = json.loads(out.getvalue(), parse_constant=lambda c: pytest.fail(f"{c} in JSON of {shown}"))
    status = document["status"]
    assert code in (0, 1, 2, 3, 4), (shown, code)
    # A run that is inaccurate is written and leaves with 4; files with problems are registered all the same.
    good = ({"ok", *USABLE} - {RunStatus.INACCURATE}) | ({"problems"} if line[0] == "data" else set())
    assert (status in good) == (code == 0) or (line[:2], status) == (["data", "verify"], "problems"), (shown, status)
    if status == "failed":
        last = [words for words in err.getvalue().splitlines() if words.startswith("srbval: ")][-1]
        assert (code >= 2, document["exit_code"], last) == (True, code, f"srbval: {document['message']}"), shown
        assert len(last) < LONGEST, shown
        assert last.isprintable(), shown
    else:
        assert code != 2, shown
        assert any(said), shown
    return code, document, list(said)


NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]\d+)?")
SCALES = {"bearing list": (1e3, 2e3, 180 / math.pi), "doctor": (1e-6,), "analyse": (100.0,)}  # table's unit over JSON's


def numbers(value: Any) -> Iterator[float]:
    """All numbers of a JSON document, those within texts and keys too."""
    if isinstance(value, dict):
        value = [*value, *value.values()]
    if isinstance(value, list):
        for inner in value:
            yield from numbers(inner)
    elif isinstance(value, str):
        yield from (float(found[0]) for found in NUMBER.finditer(value))
    elif value is not None:
        yield float(value)


def check_tables(command: str, document: dict[str, Any], text: Sequence[str]) -> None:
    """Every number in a column of a table is one of the JSON, to the digits that are printed."""
    cells = {cell for row in text for cell in re.split(r"\s{2,}", row.strip()) if "  " in row}
    printed = {cell for cell in cells if NUMBER.fullmatch(cell)}
    if printed:
        known = np.array([*numbers(document), 1.0])  # 1: the shaft's own order
        decibels = [20 * np.log10(1 + np.abs(known) / 100)] if command == "plan" else []
        known = np.concatenate([known, *decibels, *(known * scale for scale in SCALES.get(command, ()))])
        for cell in printed:
            digits, _, power = cell.partition("e")
            zeros = 0 if "." in digits else len(digits) - len(digits.rstrip("0"))  # three digits of 2738 are 2740
            last = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]) + zeros)
            assert np.abs(np.abs(known) - abs(float(cell))).min() <= 0.5001 * last, (command, cell)


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_says_one_thing(command, said):
    chance, codes = random.Random(command), set[int]()
    for _ in range(math.ceil(EXAMPLES / 1000 * SHARES.get(command, OTHERS))):
        code, document, text = answered(command_line(chance, command), said)
        codes.add(code)
        if document["status"] != "failed":
            check_tables(command, document, text)
    assert command != "analyse" or 0 in codes, "records are read"


HOSTILE_NUMBERS = ["nan", "inf", "-inf", "-1", "0", "-0.0", "1e-320", "1e308", "1e400", "1e12", "0x10", "٣", "1e-13"]
HOSTILE_NUMBERS += ["9" * 400, "9" * 5000, "1" * 1_000_000, "", " ", "\0", "\ud800"]
HOSTILE_TEXTS = ["/dev/zero", "/dev/full", "/proc/self/mem", "/", ".", "-1", "a/b/c", "no.toml", "pipe", "//[", "CON"]
HOSTILE_TEXTS += ["loop", "http://[", "~", "*", "", " ", "\0", "\ud800", "\udcff", "a\nb", "x" * 1_000_000]
WRITTEN = ("output", "plot")
NEEDED = {"campaign run": ["table5-smoke", "--dry-run"], "simulate": ["--seconds=0.02", "--model=kinematic"]}


def alike(one: argparse.Action, other: argparse.Action) -> bool:
    return (one.dest, one.type, one.metavar, one.nargs) == (other.dest, other.type, other.metavar, other.nargs)


@pytest.mark.timeout(600)
@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_with_every_hostile_value(command, said):
    """Call the first command that has an option with all hostile values, other commands with every fourth value.

    The short form takes every third of these, of each option others.
    """
    options = options_of(command)
    needed = {a: put(a, ["done" if a.dest == "folder" else "out"]) for a in options if a.required}
    every = 1 if os.environ.get("SRBVAL_TESTS") == "all" else 3
    for place, action in enumerate(options):
        if action.nargs == 0 or action.choices:
            continue
        others = [word for other, words in needed.items() if other is not action for word in words]
        first = next(name for name in COMMANDS if any(alike(one, action) for one in options_of(name)))
        step = every * (1 if first == command else 4)
        for value in (HOSTILE_NUMBERS if action.type else HOSTILE_TEXTS)[place % step :: step]:
            if command in ("data add", "analyse", "trend", "report") and value in ("/", "~"):
                continue  # legal, and long
            if action.dest in WRITTEN and value.startswith(("/", "~")):
                continue  # who tests as root would harm the machine if the program were wrong
            count = action.nargs if isinstance(action.nargs, int) else 1
            answered([*command.split(), *NEEDED.get(command, ()), *others, *put(action, [value] * count)], said)
