"""The argument parser: one place where every option is named."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from typing import Any, NoReturn

from srbval import __version__
from srbval.bearing import DEFECTS
from srbval.errors import ConfigurationError


class Parser(argparse.ArgumentParser):
    """An argument parser that reports wrong use as an ordinary `ConfigurationError` (exit code 2)."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of exiting."""
        raise ConfigurationError(f"{message}. See: {self.prog} --help")

    def flag(self, name: str, text: str) -> None:
        """Add an option without a value."""
        self.add_argument(name, action="store_true", help=text)

    def option(self, name: str, metavar: str | tuple[str, ...], text: str, **more: Any) -> None:
        """Add an option with one value, or with several (``nargs``)."""
        self.add_argument(*name.split(), metavar=metavar, help=text, **more)

    def command(self, commands: Any, name: str, text: str) -> Parser:
        """Add a command or an action below this parser; each of them takes ``--json``."""
        added: Parser = commands.add_parser(name, help=text, description=text)
        # A command's own default must not replace the value given before its action: `srbval data --json list`.
        default = argparse.SUPPRESS if self.prog.count(" ") else False
        added.add_argument("--json", action="store_true", default=default, help="print one JSON document")
        return added

    def actions(self) -> Any:
        """The actions of a command, one of which must be named."""
        return self.add_subparsers(dest="action", metavar="ACTION", required=True, parser_class=Parser)


def parser() -> Parser:
    """The parser of the whole program."""
    top = Parser(
        prog="srbval",
        description="Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.",
    )
    top.add_argument("--version", action="version", version=f"srbval {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    for name, text, add_options in (
        ("kinematics", "fault frequencies of a bearing at a shaft speed", _kinematics),
        ("simulate", "run the bundled model on a scene", _simulate),
        ("analyse", "read the fault lines of one recording or simulated run", _analyse),
        ("data", "recordings on this machine: register, list, verify, download", _data),
        ("report", "the main job: simulate, compare with paper and rig, write the report", _report),
        ("bench", "speed against accuracy: the cost and the error of every solver", _bench),
        (
            "stability",
            "where each solver fails, over step and speed, and the limit that linear theory predicts",
            _stability,
        ),
        ("plan", "the simplest model that answers a question about a scene", _plan),
        ("campaign", "many cases from one file, resumable, on this machine or a cluster", _campaign),
        ("check", "compute the reference results again, each within its tolerance", _check),
        ("doctor", "versions, threads, caches and extras of this installation", _doctor),
    ):
        command = top.command(commands, name, text)
        command.set_defaults(run=_late(name))
        add_options(command)
    return top


def _late(name: str) -> Callable[[argparse.Namespace], int]:
    """The function of a command, imported only when it runs: `srbval --help` answers at once."""

    def run(options: argparse.Namespace) -> int:
        code: int = importlib.import_module(f"srbval.cli.{name}_command").run(options)
        return code

    return run


def _kinematics(command: Parser) -> None:
    command.option("--bearing", "B", "known name or TOML file (default: %(default)s)", default="skf-22240")
    command.option("--rpm", "R", "shaft speed [rpm] (default: 710)", type=_positive, default=710.0)


def _simulate(command: Parser) -> None:
    _scene_options(command)
    command.option(
        "--model", "NAME", "rung of the ladder: kinematic, impulse, planar, line, full; or auto (default: full)"
    )
    _question_options(command, "for --model auto: ")
    command.option("-o --output", "RUN.h5", "write the signals to this HDF5 file")


def _plan(command: Parser) -> None:
    _scene_options(command)
    _question_options(command)
    command.option("--calibration", "FILE", "table written by srbval bench --ladder -o FILE (default: the one shipped)")
    command.flag("--reductions", "try which parts of the full model this scene does not need")
    command.set_defaults(model=None)


def _scene_options(command: Parser) -> None:
    command.add_argument("scene", nargs="?", metavar="SCENE.toml", help="scene file (default: the paper's scene)")
    command.option("--bearing", "B", "known name or TOML file (default: the scene's)")
    command.option("--defect", "|".join(("none", *DEFECTS)), "position of the defect")
    command.option("--defect-height-mm", "MM", "bump > 0, pit < 0", type=_number)
    command.option("--rpm", "R", "shaft speed [rpm]", type=_positive)
    command.option("--radial-kn", "KN", "radial load [kN]", type=_number)
    command.option("--axial-kn", "KN", "axial load [kN]", type=_number)
    command.option("--seconds", "S", "recorded duration [s]", type=_positive)
    command.option("--solver", "NAME", "imex2 (default), imex1, ros2, ode1 to ode4 (the paper's)")
    command.option("--dt", "S", "solver step [s]", type=_positive)
    command.option("--seed", "N", "seed of everything random in the model", type=int)


def _question_options(command: Parser, when: str = "") -> None:
    questions = "lines, harmonics, sidebands, noise-floor, slip or amplitude"
    command.option("--question", "Q", f"{when}{questions} (default: %(default)s)", default="lines")
    command.option("--tolerance", "PCT", f"{when}allowed error [%%] (default: %(default)s)", type=_number, default=0.5)


def _analyse(command: Parser) -> None:
    command.add_argument("file", metavar="FILE")
    command.option("--bearing", "B", "known name or TOML file (default: the bearing of the file's data set)")
    _recording_settings(command)
    command.option("--band", ("LO", "HI"), "demodulation band [Hz]", nargs=2, type=_number)
    command.flag(
        "--auto-band",
        "use the most impulsive band of the record itself; the false-alarm probabilities count every band tried",
    )
    command.add_argument(
        "--filter",
        choices=("butterworth", "brick-wall"),
        default="butterworth",
        help="band-pass filter (default: %(default)s)",
    )
    command.add_argument("--defect", choices=(*DEFECTS, "cage"), help="print the lines of this part only")


def _recording_settings(command: Parser) -> None:
    """What the file of a recording may leave open; read by `data_command.recording_settings`."""
    command.option("--rpm", "R", "shaft speed [rpm]", type=_positive)
    command.option("--channel", "C", "channel to analyse")
    command.option("--fs", "HZ", "sampling rate [Hz], where the file does not state it", type=_positive)
    command.option("--unit", "U", "unit of the samples, where the file does not state it")


def _data(command: Parser) -> None:
    actions = command.actions()
    add = command.command(actions, "add", "register a folder of recordings (nothing is copied)")
    add.add_argument("folder", metavar="FOLDER")
    _recording_settings(add)
    add.flag("--repin", "register again: forget old hashes and options")
    command.command(actions, "list", "what is registered")
    command.command(actions, "verify", "check every registered file against its hash")
    fetch = command.command(actions, "fetch", "download an open data set, e.g. torino-excerpts")
    fetch.add_argument("name", metavar="NAME")
    fetch.option("-o --output", "DIR", "folder for the files")


def _report(command: Parser) -> None:
    command.option("-o --output", "DIR", "folder to write (default: %(default)s)", default="srbval-report")
    command.option(
        "--seconds", "S", "recorded duration of the paper's three runs (default: 10)", type=_positive, default=10.0
    )
    command.option("--jobs", "N", "runs at a time (default: one per core)", type=int)
    command.flag("--no-pdf", "write HTML and JSON only")


def _bench(command: Parser) -> None:
    command.flag("--quick", "short runs: a first impression, not for publication")
    command.option("--scenes", "NAME", "such as play0-outer (default: all six)", nargs="+")
    command.option("--solvers", "NAME", "such as ode4 (default: all)", nargs="+")
    command.option("--seconds", "S", "duration of the runs compared (default: 4)", type=_positive)
    command.flag("--reading", "instead: the accuracy of the frequency reading, by simulation, and its run time")
    command.flag("--sensitivity", "instead: the effect of numerics and open inputs on each compared quantity")
    command.flag("--speed-only", "time the solvers without comparing them with a reference")
    command.flag("--ladder", "instead: compare every model with the full one")
    command.flag("--held-out", "with --ladder: test the planner's predictions on scenes it was not calibrated with")
    command.option("-o --output", "FILE", "store the result here (default: a complete run is stored for the report)")
    command.option("--jobs", "N", "--ladder, --reading: runs at a time (default: one per core)", type=int)


def _stability(command: Parser) -> None:
    command.flag("--quick", "a small part of the map, short runs")
    command.option("--scenes", "NAME", "such as interference-outer (default: both outer)", nargs="+")
    command.option("--solvers", "NAME", "such as ode4 (default: all)", nargs="+")
    command.option("--rpm", "R", "shaft speeds (default: 127 to 3000)", nargs="+", type=_positive)
    command.option("--critical-velocity", "V", "of friction [m/s] (default: 0.001 0.5)", nargs="+", type=_positive)
    command.option("--steps-per-s", "N", "steps as divisors of a second (default: 245760 to 7680)", nargs="+", type=int)
    command.option("--seconds", "S", "least duration of a run", type=_positive)
    command.option("--jobs", "N", "runs at a time (default: one per core)", type=int)
    command.option("-o --output", "FILE", "store the result here (default: the complete map is stored for the report)")


def _campaign(command: Parser) -> None:
    actions = command.actions()
    _campaign_run(
        command.command(actions, "run", "run what has no result yet; the same command resumes after an interruption")
    )
    status = command.command(actions, "status", "the progress of a campaign; rewrites its results table")
    status.add_argument("folder", metavar="DIR")
    export = command.command(actions, "export", "labelled segments for training, in one HDF5 file with a data card")
    export.add_argument("folder", metavar="DIR", help="campaign whose outputs include the acceleration")
    export.option("-o --output", "FILE.h5", "file to write", required=True)
    export.option("--segment-seconds", "S", "length of a segment (default: 1)", type=_positive, default=1.0)
    export.option(
        "--snr-db",
        "DB",
        "signal-to-noise ratios of added noise (default: no noise)",
        nargs="+",
        type=_number,
        default=[],
    )
    export.option("--noise", "white|RECORDING", "white, or coloured like this recording", default="white")
    export.option("--seed", "N", "of the noise", type=int, default=0)
    noise = command.command(actions, "noise", "how detection degrades with noise; stored for the report")
    noise.option("--noise", "white|RECORDING", "colours of the noise", nargs="+", default=["white"])
    noise.option("--seconds", "S", "duration of the runs (default: 2)", type=_positive, default=2.0)
    scale = command.command(
        actions, "scale", "the overhead of very many cases, measured with tiny ones; stored for the report"
    )
    scale.option("--cases", "N", "number of cases (default: 10000)", type=int, default=10_000)
    scale.option("--engine", "E", "as for run", default="auto")
    for study in (noise, scale):
        study.option("-o --output", "FILE", "store the result here (default: the user's cache)")


def _campaign_run(run: Parser) -> None:
    run.add_argument("campaign", metavar="FILE.toml|PRESET", help="campaign file, or table5, table5-smoke")
    run.option("-o --output", "DIR", "folder of the campaign (default: srbval-NAME)")
    run.flag("--dry-run", "print the cases, their models and the expected time and disk space; run nothing")
    run.option("--engine", "E", "serial, local, dask (needs --address) or slurm (default: local)", default="auto")
    run.option("--jobs", "N", "cases at a time (default: one per core)", type=int)
    run.option("--address", "URL", "of a Dask scheduler that is already running")
    run.option("--wait", "S", "for a Dask worker when there is none [s] (default: 120; slurm 3600)", type=_positive)
    run.option("--limit-factor", "X", "end a case after X times its expected time; 0: never", type=_number)
    run.option("--least-limit", "S", "but not before this wall time [s]", type=_positive)


def _check(command: Parser) -> None:
    command.option("--junit", "FILE", "write a JUnit report as well")
    command.flag("--update", "show what differs, then replace the reference results")
    command.flag("--yes", "with --update: replace without asking")
    command.option("--reference", "FILE", "reference file (default: the one of this version)")


def _doctor(command: Parser) -> None:
    command.add_argument(
        "--clear-cache",
        nargs="*",
        metavar="KIND",
        help="delete the cache, or only these kinds of content (kernels, ...)",
    )


def _number(text: str) -> float:
    number = float(text)
    if number != number or number in (float("inf"), float("-inf")):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return number


def _positive(text: str) -> float:
    number = _number(text)
    if number <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} must be positive")
    return number
