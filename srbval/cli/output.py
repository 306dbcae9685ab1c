"""Output of the commands: results on standard output, messages on standard error."""

import argparse
import json
import shlex
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.errors import DataError, NumericsError, SrbvalError
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.installation import import_library
from srbval.storage.json_files import json_text, to_json

WIDTH = 99  # characters per line of text output
OUTPUT_SCHEMA_VERSION = 1
STATUS = {0: "ok", 1: "out of tolerance", DataError.exit_code: "incomplete", NumericsError.exit_code: "run failed"}


def print_result(
    options: argparse.Namespace,
    document: Any,
    show: str | Callable[[], None],
    *,
    status: str = "",
    code: int = 0,
    tables: Mapping[str, Any] | None = None,
) -> int:
    """Print the result of a command and return the exit code `code`.

    With ``--json`` the `document` (mapping or dataclass) is printed with the field `status` (default: `STATUS[code]`).
    Without it the text `show` is printed, or the function `show` prints the result. With ``--export`` the `tables`
    (lists of rows by name, by default all lists of mappings in the document) are written to a file.
    """
    if options.export:
        write_tables(Path(options.export), to_json(document) if tables is None else to_json(tables))
    if options.json:
        print_json(to_json(document), status=status or STATUS[code])
    elif isinstance(show, str):
        print(show)
    else:
        show()
    return code


def print_json(document: Mapping[str, Any], *, status: str = "ok") -> None:
    """Print a JSON document with `schema_version` and `status`; NaN and infinity become null."""
    whole = {"schema_version": OUTPUT_SCHEMA_VERSION, "status": status} | dict(document)
    ascii_only = not str(sys.stdout.encoding).lower().startswith("utf")  # JSON does not know Python's escapes
    print(json_text(whole, ascii_only=ascii_only), end="")


def export_file(text: str) -> str:
    """Check and return the file name of ``--export``: CSV, or Excel if the library openpyxl is installed."""
    check_suffix(Path(text), "CSV or Excel", (".csv", ".xlsx"))
    if text.endswith(".xlsx"):
        import_library("openpyxl", "an Excel file")
    return text


def write_tables(path: Path, document: Mapping[str, Any]) -> None:
    """Write every table in `document` (list of mappings, one per row) as an Excel sheet or a CSV file.

    Without a table, the values of the document become one row. The first CSV file is `path`; the other file names
    end with the name of their table. Nested values become columns with dotted names. A question mark replaces each
    character that UTF-8 cannot encode, as in a damaged file name.
    """
    import pandas as pd

    document = json.loads(json.dumps(document, ensure_ascii=False).encode("utf-8", "replace"))
    tables = {
        name: rows
        for name, rows in document.items()
        if isinstance(rows, list) and rows and all(isinstance(row, dict) for row in rows)
    }
    frames = {
        name: pd.json_normalize(rows).map(lambda x: " ".join(map(str, x)) if isinstance(x, list) else x)
        for name, rows in (tables or {"result": [dict(document)]}).items()
    }
    if path.suffix == ".xlsx":
        with atomic_write(path) as part, part.open("wb") as file, pd.ExcelWriter(file, engine="openpyxl") as book:
            for name, frame in frames.items():
                frame.to_excel(book, sheet_name=name[:31], index=False)
        return
    for number, (name, frame) in enumerate(frames.items()):
        with atomic_write(path.with_stem(f"{path.stem}-{name}") if number else path) as part:
            frame.to_csv(part, index=False, lineterminator="\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file completely or not at all."""
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def missing_options(error: SrbvalError, given: Sequence[str]) -> str:
    """List the information that a file lacks, and repeat the `given` command with an example of each missing option."""
    example = " ".join([shlex.join(["srbval", *given]), *(question.example for question in error.questions)])
    more = "Or store the options once: srbval data add FILE|DIR OPTIONS, or in a machine file: --machine FILE.toml"
    if given[:1] == ["analyse"]:
        example += " --write-machine machine.toml"
        more = "This also stores the options; the next record needs only: srbval analyse FILE --machine machine.toml"
    questions = (f"  {question}" for question in error.questions)
    return "\n".join([f"{error.subject} lacks information:", *questions, "", f"For example: {example}", more])


def print_wrapped(*texts: str) -> None:
    """Print each text in lines of at most `WIDTH` characters; all but its first line are indented."""
    for text in texts:
        print(textwrap.fill(text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False))


def own_command() -> str:
    """Return the running command as text for reports; absolute paths are reduced to file names."""
    given = [Path(word).name if Path(word).is_absolute() else word for word in sys.argv[1:]]
    return shlex.join(["srbval", *given])
