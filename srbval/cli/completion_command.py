"""``srbval completion``: a script that completes commands and options in a shell, by the library shtab."""

import argparse
from collections.abc import Iterator

from srbval.cli.arguments import parser
from srbval.cli.output import print_json
from srbval.errors import ConfigurationError

PATHS = ("FILE", "DIR", "FOLDER", ".h5", ".toml", ".csv", "SCENE", "RECORDING")  # metavars of what are paths


def run(options: argparse.Namespace) -> int:
    """Print the script of the shell named."""
    try:
        import shtab
    except ImportError:
        raise ConfigurationError('completion needs the library shtab: pip install "srbval[completion]"') from None
    whole = parser()
    for action in _actions(whole):
        if action.choices is None and any(path in str(action.metavar) for path in PATHS):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    script = shtab.complete(whole, shell=options.shell)
    if options.json:
        print_json({"shell": options.shell, "script": script})
    else:
        print(script)
    return 0


def _actions(of: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in of._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from _actions(inner)
