"""What the commands print: data on standard output, messages on standard error."""

import argparse
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.progress.tables import text_table
from srbval.storage.json_files import json_text, to_json

SCHEMA_VERSION = 1
STATUS = {0: "ok", 1: "out of tolerance", DataError.exit_code: "damaged"}  # by exit code


def answer(
    options: argparse.Namespace, document: Any, show: str | Callable[[], None], *, status: str = "", code: int = 0
) -> int:
    """What every command ends with: the `document` (mapping or dataclass) with ``--json``, else the text or `show()`.

    Returns the exit code, `code`; without a `status` the document has that of the code in `STATUS`.
    """
    if options.json:
        print_json(to_json(document), status=status or STATUS[code])
    elif isinstance(show, str):
        print(show)
    else:
        show()
    return code


def print_json(document: Mapping[str, Any], *, status: str = "ok") -> None:
    """Print one JSON document with `schema_version` and `status`; NaN and infinities become null."""
    whole = {"schema_version": SCHEMA_VERSION, "status": status} | dict(document)
    ascii_only = not str(sys.stdout.encoding).lower().startswith("utf")  # an escape of Python's is none of JSON's
    print(json_text(whole, ascii_only=ascii_only), end="")


def print_failure(message: str, code: int, *, as_json: bool) -> None:
    """Say what failed on standard error, and as JSON on standard output where that was asked for."""
    print(f"srbval: {message}", file=sys.stderr)
    if as_json:
        print_json({"message": message, "exit_code": code}, status="failed")


def print_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print aligned columns; numbers to the right."""
    print(text_table(columns, rows))


def own_command() -> str:
    """The command that runs, as others may repeat it: a file named by its whole path is named by its own name."""
    given = [Path(word).name if Path(word).is_absolute() else word for word in sys.argv[1:]]
    return shlex.join(["srbval", *given])
