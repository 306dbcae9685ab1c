"""The argument parser: one place where every option is named."""

from __future__ import annotations

import argparse
import importlib
from typing import Any, NoReturn

from srbval import __version__
from srbval.errors import ConfigurationError


class Parser(argparse.ArgumentParser):
    """An argument parser whose complaint is an ordinary `ConfigurationError` (exit code 2)."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of exiting."""
        raise ConfigurationError(f"{message}. See: {self.prog} --help")


def parser() -> Parser:
    """The parser of the whole program."""
    top = Parser(
        prog="srbval",
        description="Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.",
    )
    top.add_argument("--version", action="version", version=f"srbval {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    _kinematics(commands)
    _simulate(commands)
    _analyse(commands)
    _data(commands)
    _report(commands)
    _bench(commands)
    _stability(commands)
    _plan(commands)
    _campaign(commands)
    _check(commands)
    _command(commands, "doctor", "versions, threads, caches, extras: is this installation sound?")
    return top


def _command(commands: Any, name: str, text: str, module: str | None = None) -> Parser:
    command: Parser = commands.add_parser(name, help=text, description=text)
    command.add_argument("--json", action="store_true", help="print one JSON document")
    command.set_defaults(run=_late(module or name))
    return command


def _late(module: str) -> Any:
    """The command's function, imported only when it runs: `srbval --help` answers at once."""

    def run(options: argparse.Namespace) -> int:
        code: int = importlib.import_module(f"srbval.cli.{module}_command").run(options)
        return code

    return run


def _kinematics(commands: Any) -> None:
    command = _command(commands, "kinematics", "fault frequencies of a bearing at a shaft speed")
    command.add_argument(
        "--bearing", default="skf-22240", metavar="B", help="known name or TOML file (default: %(default)s)"
    )
    command.add_argument("--rpm", type=_positive, default=710.0, metavar="R", help="shaft speed [rpm] (default: 710)")


def _simulate(commands: Any) -> None:
    command = _command(commands, "simulate", "run the bundled model on a scene")
    _scene_options(command)
    command.add_argument(
        "--model",
        metavar="NAME",
        help="rung of the ladder: kinematic, impulse, planar, line, full; or auto (default: full)",
    )
    _question_options(command, "for --model auto: ")
    command.add_argument("-o", "--output", metavar="RUN.h5", help="write the signals to this HDF5 file")


def _plan(commands: Any) -> None:
    command = _command(commands, "plan", "the least model that answers a question on a scene")
    _scene_options(command)
    _question_options(command)
    command.add_argument("--calibration", metavar="FILE", help="table of srbval bench --ladder -o FILE (default: ours)")
    command.add_argument("--reductions", action="store_true", help="try what the scene itself can do without")
    command.set_defaults(model=None)


def _scene_options(command: Parser) -> None:
    command.add_argument("scene", nargs="?", metavar="SCENE.toml", help="scene file (default: the paper's scene)")
    command.add_argument("--bearing", metavar="B", help="known name or TOML file (default: the scene's)")
    command.add_argument("--defect", metavar="none|outer|inner|roller", help="where the defect is")
    command.add_argument("--defect-height-mm", type=_number, metavar="MM", help="bump > 0, pit < 0")
    command.add_argument("--rpm", type=_positive, metavar="R", help="shaft speed [rpm]")
    command.add_argument("--radial-kn", type=_number, metavar="KN", help="radial load [kN]")
    command.add_argument("--axial-kn", type=_number, metavar="KN", help="axial load [kN]")
    command.add_argument("--seconds", type=_positive, metavar="S", help="recorded duration [s]")
    command.add_argument("--solver", metavar="NAME", help="imex2 (default), imex1, ros2, ode1 to ode4 (the paper's)")
    command.add_argument("--dt", type=_positive, metavar="S", help="solver step [s]")
    command.add_argument("--seed", type=int, metavar="N", help="seed of everything random in the model")


def _question_options(command: Parser, when: str = "") -> None:
    command.add_argument(
        "--question",
        default="lines",
        metavar="Q",
        help=f"{when}lines, harmonics, sidebands, noise-floor, slip or amplitude (default: %(default)s)",
    )
    command.add_argument(
        "--tolerance", type=_number, default=0.5, metavar="PCT", help=f"{when}error allowed [%%] (default: %(default)s)"
    )


def _analyse(commands: Any) -> None:
    command = _command(commands, "analyse", "one recording or simulated run through the one signal pipeline")
    command.add_argument("file", metavar="FILE")
    command.add_argument(
        "--bearing", metavar="B", help="known name or TOML file (default: what the file's data set says)"
    )
    _settings(command)
    command.add_argument("--band", nargs=2, type=_number, metavar=("LO", "HI"), help="demodulation band [Hz]")
    command.add_argument(
        "--auto-band",
        action="store_true",
        help="take the most impulsive band of the record itself; every band tried counts in the false-alarm "
        "probabilities",
    )
    command.add_argument(
        "--filter",
        choices=("butterworth", "brick-wall"),
        default="butterworth",
        help="how the band is cut out (default: %(default)s)",
    )
    command.add_argument(
        "--defect", choices=("outer", "inner", "roller", "cage"), help="print the lines of this part only"
    )


def _settings(command: Parser) -> None:
    """What a recording leaves open; read by `settings_of`."""
    command.add_argument("--rpm", type=_positive, metavar="R", help="shaft speed [rpm]")
    command.add_argument("--channel", metavar="C", help="channel to analyse")
    command.add_argument("--fs", type=_positive, metavar="HZ", help="sampling rate [Hz], where the file does not say")
    command.add_argument("--unit", metavar="U", help="unit of the samples, where the file does not say")


def _data(commands: Any) -> None:
    command = _command(commands, "data", "recordings on this machine: register, list, verify, download")
    actions = command.add_subparsers(dest="action", metavar="ACTION", required=True, parser_class=Parser)
    for name, text, argument in (
        ("add", "register a folder of recordings (nothing is copied)", "folder"),
        ("list", "what is registered", None),
        ("verify", "check every registered file against its hash", None),
        ("fetch", "download an open data set, e.g. torino-excerpts", "name"),
    ):
        action = actions.add_parser(name, help=text, description=text)
        action.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON document")
        if argument:
            action.add_argument(argument, metavar=argument.upper())
        if name == "add":
            _settings(action)
            action.add_argument("--repin", action="store_true", help="register anew: forget old hashes and options")
        if name == "fetch":
            action.add_argument("-o", "--output", metavar="DIR", help="where to put the files")


def _report(commands: Any) -> None:
    command = _command(commands, "report", "the main job: simulate, compare with paper and rig, write the report")
    command.add_argument(
        "-o",
        "--output",
        default="srbval-report",
        metavar="DIR",
        help="folder to write (default: %(default)s)",
    )
    command.add_argument(
        "--seconds",
        type=_positive,
        default=10.0,
        metavar="S",
        help="recorded duration of the paper's three runs (default: 10)",
    )
    command.add_argument("--jobs", type=int, metavar="N", help="runs at a time (default: one per core)")
    command.add_argument("--no-pdf", action="store_true", help="write HTML and JSON only")


def _bench(commands: Any) -> None:
    command = _command(commands, "bench", "speed against accuracy: what each solver costs, and how wrong it is")
    command.add_argument("--quick", action="store_true", help="short runs: a first look, no figures to quote")
    command.add_argument("--scenes", nargs="+", metavar="NAME", help="such as play0-outer (default: all six)")
    command.add_argument("--solvers", nargs="+", metavar="NAME", help="such as ode4 (default: all)")
    command.add_argument("--seconds", type=_positive, metavar="S", help="duration of the runs compared (default: 4)")
    command.add_argument(
        "--reading", action="store_true", help="instead: how well frequencies are read, by simulation; signal timings"
    )
    command.add_argument(
        "--sensitivity", action="store_true", help="instead: what numerics and open inputs do to each compared quantity"
    )
    command.add_argument("--speed-only", action="store_true", help="time the solvers, compare with no reference")
    command.add_argument("--ladder", action="store_true", help="hold every model against the full one instead")
    command.add_argument(
        "--held-out", action="store_true", help="with --ladder: hold the planner's predictions against fresh scenes"
    )
    command.add_argument(
        "-o", "--output", metavar="FILE", help="keep the result here (default: a whole run is kept for the report)"
    )
    command.add_argument("--jobs", type=int, metavar="N", help="--ladder, --reading: at a time (default: all cores)")


def _stability(commands: Any) -> None:
    command = _command(
        commands, "stability", "where each solver fails: step by speed, and the limit linear theory gives"
    )
    command.add_argument("--quick", action="store_true", help="a small part of the map, short runs")
    command.add_argument("--scenes", nargs="+", metavar="NAME", help="such as interference-outer (default: both outer)")
    command.add_argument("--solvers", nargs="+", metavar="NAME", help="such as ode4 (default: all)")
    command.add_argument("--rpm", nargs="+", type=_positive, metavar="R", help="shaft speeds (default: 127 to 3000)")
    command.add_argument(
        "--critical-velocity", nargs="+", type=_positive, metavar="V", help="of friction [m/s] (default: 0.001 0.5)"
    )
    command.add_argument(
        "--steps-per-s",
        nargs="+",
        type=int,
        metavar="N",
        help="steps as divisors of a second (default: 245760 to 7680)",
    )
    command.add_argument("--seconds", type=_positive, metavar="S", help="least duration of a run")
    command.add_argument("--jobs", type=int, metavar="N", help="runs at a time (default: one per core)")
    command.add_argument(
        "-o", "--output", metavar="FILE", help="keep the result here (default: the whole map is kept for the report)"
    )


def _campaign(commands: Any) -> None:
    command = _command(commands, "campaign", "many cases from one file, resumable, on this machine or a cluster")
    actions = command.add_subparsers(dest="action", metavar="ACTION", required=True, parser_class=Parser)
    run = _action(actions, "run", "run what has no result yet; the same command goes on after an interruption")
    run.add_argument("campaign", metavar="FILE.toml|PRESET", help="campaign file, or table5, table5-smoke")
    run.add_argument("-o", "--output", metavar="DIR", help="folder of the campaign (default: srbval-NAME)")
    run.add_argument("--dry-run", action="store_true", help="print cases, models, time and disk expected; run nothing")
    run.add_argument(
        "--engine", default="auto", metavar="E", help="serial, local, dask or slurm (default: dask if installed)"
    )
    run.add_argument("--jobs", type=int, metavar="N", help="cases at a time (default: one per core)")
    run.add_argument("--address", metavar="URL", help="of a Dask scheduler that is there already")
    run.add_argument(
        "--wait",
        type=_positive,
        metavar="S",
        help="for a Dask worker where there is none [s] (default: 120; slurm 3600)",
    )
    run.add_argument(
        "--limit-factor", type=_number, metavar="X", help="end a case after X times its planned time; 0: never"
    )
    run.add_argument("--least-limit", type=_positive, metavar="S", help="but not before this wall time [s]")
    status = _action(actions, "status", "how far a campaign is; writes its results table anew")
    status.add_argument("folder", metavar="DIR")
    export = _action(actions, "export", "labelled segments for training, in one HDF5 with a data card")
    export.add_argument("folder", metavar="DIR", help="campaign whose outputs hold the acceleration")
    export.add_argument("-o", "--output", metavar="FILE.h5", required=True)
    export.add_argument("--segment-seconds", type=_positive, default=1.0, metavar="S", help="default: 1")
    export.add_argument(
        "--snr-db", nargs="+", type=_number, default=[], metavar="DB", help="ratios of added noise (default: no noise)"
    )
    export.add_argument(
        "--noise", default="white", metavar="white|RECORDING", help="white, or coloured as this recording is"
    )
    export.add_argument("--seed", type=int, default=0, metavar="N", help="of the noise")

    noise = _action(actions, "noise", "how detection falls with noise; kept for the report")
    noise.add_argument("--noise", nargs="+", default=["white"], metavar="white|RECORDING", help="colours of the noise")
    noise.add_argument("--seconds", type=_positive, default=2.0, metavar="S", help="duration of the runs (default: 2)")
    scale = _action(actions, "scale", "what very many cases cost, by tiny ones; kept for the report")
    scale.add_argument("--cases", type=int, default=10_000, metavar="N", help="default: 10000")
    scale.add_argument("--engine", default="auto", metavar="E", help="as for run")
    for study in (noise, scale):
        study.add_argument("-o", "--output", metavar="FILE", help="keep the result here (default: the user's cache)")


def _check(commands: Any) -> None:
    command = _command(commands, "check", "a fresh run against the reference results, each within its tolerance")
    command.add_argument("--junit", metavar="FILE", help="write a JUnit report as well")
    command.add_argument("--update", action="store_true", help="show what differs, then replace the reference results")
    command.add_argument("--yes", action="store_true", help="with --update: replace without asking")
    command.add_argument("--reference", metavar="FILE", help="reference file (default: the one of this version)")


def _action(actions: Any, name: str, text: str) -> Parser:
    action: Parser = actions.add_parser(name, help=text, description=text)
    action.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON document")
    return action


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
