"""What the commands print: data on standard output, messages on standard error."""

import math
import shlex
import sys
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from srbval.storage.strict_json import strict_json

SCHEMA_VERSION = 1


def print_json(document: Mapping[str, Any], *, status: str = "ok") -> None:
    """Print one JSON document with `schema_version` and `status`; NaN and infinities become null."""
    whole = {"schema_version": SCHEMA_VERSION, "status": status} | dict(document)
    ascii_only = not str(sys.stdout.encoding).lower().startswith("utf")  # an escape of Python's is none of JSON's
    print(strict_json(whole, ascii_only=ascii_only), end="")


def print_failure(message: str, code: int, *, as_json: bool) -> None:
    """Say what failed on standard error, and as JSON on standard output where that was asked for."""
    print(f"srbval: {message}", file=sys.stderr)
    if as_json:
        print_json({"message": message, "exit_code": code}, status="failed")


def print_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print aligned columns; numbers to the right."""
    texts = [[_text(value) for value in row] for row in rows]
    widths = [max(len(title), *(len(row[i]) for row in texts)) if texts else len(title)
              for i, title in enumerate(columns)]  # fmt: skip
    right = [bool(rows) and all(isinstance(row[i], int | float | None) for row in rows) for i in range(len(columns))]
    for line in [list(columns), *texts]:
        cells = (t.rjust(w) if r else t.ljust(w) for t, w, r in zip(line, widths, right, strict=True))
        print("  ".join(cells).rstrip())


def print_columns(table: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print an empty line and the columns of `table`, as ``columns.toml`` names them, of the rows; four digits."""
    columns = _columns()[table]
    print()
    print_table(tuple(columns), [[_rounded(row[key]) for key in columns.values()] for row in rows])


@cache
def _columns() -> dict[str, dict[str, str]]:
    return tomllib.loads((files("srbval.cli") / "columns.toml").read_text(encoding="utf-8"))


def _rounded(value: Any) -> Any:
    return float(f"{value:.4g}") if isinstance(value, float) else value


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.6g}"
    return "".join(c if c.isprintable() else "?" for c in str(value))


def own_command() -> str:
    """The command that runs, as others may repeat it: a file named by its whole path is named by its own name."""
    given = [Path(word).name if Path(word).is_absolute() else word for word in sys.argv[1:]]
    return shlex.join(["srbval", *given])
