"""Argument parser, built from ``commands.toml``, which lists every command, and the ``study.toml`` of every study."""

from __future__ import annotations

import argparse
import re
import tomllib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NoReturn

from srbval import __version__
from srbval.cli.output import export_file
from srbval.errors import ConfigurationError, closest_word
from srbval.models.outside.names import COMMAND
from srbval.storage.installation import package_folder
from srbval.storage.tables import parse_quantity, read_toml

CommandTable = Mapping[str, Any]
INVALID_CHOICE = re.compile(r"invalid choice: '(.*?)' \(choose from (.*)\)")  # message of argparse


class Parser(argparse.ArgumentParser):
    """Argument parser that raises `ConfigurationError` (exit code 2) instead of exiting.

    The message suggests the closest known command, option or choice.
    """

    def error(self, message: str) -> NoReturn:
        """Raise `ConfigurationError` with the `message`, a suggestion and a reference to ``--help``."""
        choice = INVALID_CHOICE.search(message)
        hint = _suggest(choice[1], re.findall(r"[\w-]+", choice[2])) if choice else ""
        raise ConfigurationError(f"{message}.{hint} See: {self.prog} --help")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse `args`; the error for an unknown option suggests a known one."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            options = list(self._option_string_actions)
            hints = dict.fromkeys(_suggest(w.split("=")[0], options) for w in unknown if w.startswith("-"))
            raise ConfigurationError(f"unknown argument: {' '.join(unknown)}.{''.join(hints)} See: {self.prog} --help")
        return found, unknown

    def add_command(self, commands: Any, name: str, table: CommandTable, groups: CommandTable) -> None:
        """Add the command `name` to `commands`; `table` lists its options and sub-commands, `groups` shared options."""
        example = f"example: {table['example']}" if "example" in table else None
        about = {"help": table["help"], "description": table["help"], "epilog": example}
        added: Parser = commands.add_parser(name, **about)
        # A command's own default must not replace the value given before its action: `srbval data --json list`.
        default = argparse.SUPPRESS if self.prog.count(" ") else False
        added.add_argument("--json", action="store_true", default=default, help="print the result as one JSON document")
        export: dict[str, Any] = {"metavar": "OUT.csv|xlsx", "type": export_file, "default": default or None}
        words = "write the result to this CSV or Excel file; if it has several tables, each gets its own file or sheet"
        added.add_argument("--export", help=words, **export)
        for group in (*table.get("groups", ()), ""):
            arguments = groups[group] if group else table.get("arguments", {})
            to = added.add_argument_group(group) if group else added
            to = to.add_mutually_exclusive_group() if group in ALTERNATIVES else to
            for names, settings in arguments.items():
                given = settings | ({"type": ARGUMENT_TYPES[settings["type"]]} if "type" in settings else {})
                several = {"metavar": tuple(settings["metavar"])} if settings.get("nargs") in (2, 3) else {}
                one = to.add_argument(*names.split(), **given | several)
                if any(word in str(one.metavar) for word in PATHS):
                    one.complete = COMPLETE_FILES  # type: ignore[attr-defined]
        added.set_defaults(**{key: table[key] for key in ("run", "study") if key in table})
        if "actions" in table:
            actions = added.add_subparsers(dest="action", metavar="ACTION", required=True, parser_class=Parser)
            for action, about in table["actions"].items():
                added.add_command(actions, action, about, groups)


def command_tables() -> dict[str, Any]:
    """Read all commands and groups of options as nested tables; ``study run`` has an action for each study."""
    tables = read_toml(package_folder() / "cli" / "commands.toml")
    commands = tables["commands"]
    studies = commands["study"]["actions"]["run"]["actions"] = {}
    for path in sorted((package_folder() / "studies").glob("*/study.toml")):
        study = read_toml(path)
        about = {"study": path.parent.name, "groups": ["study"], "help": study["question"]}
        studies[path.parent.name] = about | {"arguments": study.get("options", {})}
    for command in commands.values():
        if "study" in command:  # another name for the command that runs this study
            studies[command["study"]]["groups"] = command["groups"]
            command["arguments"] = studies[command["study"]]["arguments"]
    return tables


def build_parser() -> Parser:
    """Build the argument parser of `srbval` with all commands."""
    purpose = "Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings."
    top = Parser(prog="srbval", description=purpose)
    top.add_argument("--version", action="version", version=f"srbval {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    tables = command_tables()
    for name, table in tables["commands"].items():
        top.add_command(commands, name, table, tables["groups"])
    return top


def _suggest(word: str, known: Sequence[str]) -> str:
    close = closest_word(word, known)
    return f" Did you mean {close}?" if close else ""


def _read_number(kind: type, low: float, high: float, text: str) -> float:
    """Convert an argument to a number of type `kind`, at least `low` and at most `high`."""
    expected = "a whole number" if kind is int else "a number"
    try:
        number: float = kind(text)
    except ValueError:
        hint = "; decimals have a point" if "," in text else ""
        raise argparse.ArgumentTypeError(f"{text!r} is not {expected}{hint}") from None
    if not low <= number <= high:
        raise argparse.ArgumentTypeError(f"{text!r} must be {expected}, at least {low:g} and at most {high:g}")
    return number


def _step(text: str) -> float | str:
    """Read a solver step: ``auto``, seconds, or a number with a unit such as ``16us``."""
    if text == AUTO_STEP:
        return AUTO_STEP
    step_s = parse_quantity(text if text[-1:].isalpha() else f"{text} s", "time", "--dt")
    return _read_number(float, SMALLEST, LARGEST, repr(step_s))


AUTO_STEP = "auto"
LARGEST, SMALLEST = 1e12, 1e-12  # limits of every numerical option, in any unit
MOST_DB = 200.0


def _inline_bearing(kind: str, text: str) -> str:
    """Check the argument of ``--elements`` or ``--orders`` (`kind`); return a text that `load_bearing` accepts."""
    from srbval.bearing import load_bearing

    return load_bearing(f"{kind} {text.replace(' ', '')}").name


def _setting(text: str) -> tuple[str, Any]:
    """Split ``KEY=VALUE`` and read the value as TOML; a value that is not TOML stays text."""
    key, mark, value = (part.strip() for part in text.partition("="))
    if not mark:
        raise argparse.ArgumentTypeError(f"{text!r}: write KEY=VALUE")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def _tolerance(text: str) -> float:
    """Read a tolerance in per cent; convert a tolerance in dB, such as ``3dB``, to per cent."""
    if not text.endswith("dB"):
        return _read_number(float, -LARGEST, LARGEST, text)
    from srbval.plan.questions import pct_of  # slow import

    return pct_of(_read_number(float, 0, MOST_DB, text.removesuffix("dB")))


def _record(name: str) -> str:
    """Path of the shipped recording called `name`; `name` itself if there is none, or if a file `name` exists."""
    from srbval.recordings.registry import find_shipped  # imports slow modules

    return str(find_shipped(name))


PATHS = ("FILE", "DIR", "FOLDER", ".h5", ".toml", ".csv", "SCENE", "RECORDING")  # metavars of paths
# Functions that complete file names in a shell, for the library shtab.
COMPLETE_FILES = {"bash": "_shtab_compgen_files", "zsh": "_files", "fish": "(__fish_complete_path (commandline -ct))"}
ALTERNATIVES = ("bearing", "band", "model")  # groups whose options exclude each other
ARGUMENT_TYPES = {
    "elements": partial(_inline_bearing, "elements"),
    "orders": partial(_inline_bearing, "orders"),
    "finite": partial(_read_number, float, -LARGEST, LARGEST),
    "kN": lambda text: _read_number(float, -LARGEST, LARGEST, text) * 1e3,  # [N]
    "mm": lambda text: _read_number(float, -LARGEST, LARGEST, text) * 1e-3,  # [m]
    "positive": partial(_read_number, float, SMALLEST, LARGEST),
    "count": partial(_read_number, int, 1, 10**9),
    "jobs": partial(_read_number, int, 1, 1024),
    "seed": partial(_read_number, int, 0, 2**62),
    "step": _step,
    "command": COMMAND.__add__,
    "record": _record,
    "tolerance": _tolerance,
    "setting": _setting,
}
