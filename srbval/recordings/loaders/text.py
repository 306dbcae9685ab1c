"""Text tables: comma, semicolon, tab or blank separated, with or without a header line."""

import codecs
import csv
import io
import re
import threading
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.loaders.limited import FileFormat
from srbval.recordings.raw import TEXT, RawFile, first_line, printable
from srbval.recordings.reading import known_unit

MAX_COLUMNS = 1024
MAX_LINE = 65536
TRIED_ROWS = 3  # rows of which one must hold numbers, or the text is not a table
UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_WARNINGS = threading.Lock()  # catch_warnings changes the state of the whole process
_CONTROL = re.compile(r"[\0-\x08\x0b\x0d-\x1f]")
_COMMENT = re.compile(r"^(?:%|//)")
_SETTING = re.compile(r"#\s*([A-Za-z_]\w*)\s*[=:]\s*(.+?)\s*")
_LIKE_A_NUMBER = re.compile(r"[+\-−]?[.,]?\d|(?:[+-]?(?:nan|inf|infinity)|null|none|n/?a)?$", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?", re.ASCII)
_NO_THOUSANDS = re.compile(r"(?<!\d)0,\d|,\d{1,2}(?!\d)|,\d{4}")
_SPLIT_DECIMAL = re.compile(r"[,\n][ \t]*[+-]?0\d+[ \t]*[,\n]")
_MINUS_ZERO = re.compile(r"[,\n][ \t]*-0[ \t]*[,\n]")


def load_text(path: Path) -> RawFile:
    """Read the columns of a text table under their header's names, else ``col_1``, ``col_2``, ...

    Lines that begin with ``#``, ``%`` or ``//`` are comments; ``# fs_hz = 20480`` before the first row is an attribute.
    The header may have a second line, of units. Decimal commas are read if another separator leaves no doubt. Raises
    `DataError` for any row that is not like the others, and any field that is not a finite number.
    """
    lines, notes = _lines(path)
    rows = [i for i, line in enumerate(lines) if line and not line.startswith("#")]
    if not rows:
        raise NoRecordingError(f"{path}: a text file without a table of numbers.")
    first, second = lines[rows[0]], lines[rows[min(1, len(rows) - 1)]]
    separator = next((mark for mark in (";", "\t", ",") if mark in second), None)
    if separator == "," and len(second.split()) > 1 and all(map(_DECIMAL_COMMA.fullmatch, second.split())):
        separator = None
    names = _fields(first, separator)
    if not 1 <= len(names) <= MAX_COLUMNS:
        raise NoRecordingError(
            f"{path}: {len(names)} columns in the first line; a table of numbers has 1 to {MAX_COLUMNS}."
        )
    has_header = not _numbers(first, separator)
    units = _units(lines[rows[1]], separator, len(names)) if has_header and len(rows) > 1 else []
    data = rows[has_header + bool(units) :]
    if not any(_numbers(lines[row], separator) for row in data[:TRIED_ROWS]):
        wrong = f"line {data[0] + 1} is {printable(lines[data[0]])!r}" if data else "nothing after line 1"
        raise NoRecordingError(f"{path}: a text file, but not a table of numbers ({wrong}).")
    columns = _columns(path, lines, data, separator)
    if has_header:
        names = [first] if columns == 1 and not re.search(r"[,;\t]", first) else names
        _check_names(f"{path}: line {rows[0] + 1}", names, columns, separator)
    table, comma = _table(path, lines, data, separator, columns)
    keys = names if has_header else [f"col_{i + 1}" for i in range(columns)]
    variables = {key: np.ascontiguousarray(table[:, i]) for i, key in enumerate(keys)}
    notes += ("decimal commas read as decimal points",) if comma else ()
    settings = _settings(path, lines[: rows[0]])
    said = {name: unit for name, unit in zip(names, units, strict=False) if unit}
    return RawFile(path=path, format=TEXT, variables=variables, attributes=settings, notes=notes, units=said)


def _lines(path: Path) -> tuple[list[str], tuple[str, ...]]:
    """The lines, without blanks at their ends, and what is to be noted."""
    content = path.read_bytes()
    try:
        text = content.decode("utf-16" if content.startswith(UTF16) else "utf-8-sig")
    except UnicodeError as error:
        if content.startswith(UTF16):
            raise DataError(f"{path}: damaged UTF-16 text ({first_line(error)}). Save it as UTF-8.") from None
        text = content.decode("latin-1")
    text = text.replace("\r\n", "\n")
    text = text if "\n" in text else text.replace("\r", "\n")
    lines = [_COMMENT.sub("#", line.strip(" \f")) for line in text.split("\n")]
    if max(map(len, lines)) >= MAX_LINE:
        raise NoRecordingError(f"{path}: a line of more than {MAX_LINE} characters is not a table of numbers.")
    wrong = [i for i, line in enumerate(lines) if _CONTROL.search(line)] if _CONTROL.search(text) else []
    _refuse(path, wrong, "with control characters", "Copy the damaged file again")
    return lines, () if text.endswith("\n") else ("the last line has no end: the file may have been cut there",)


def _refuse(path: Path, wrong: Sequence[int], what: str, remedy: str) -> None:
    """Raise `DataError` if there are `wrong` lines."""
    if len(wrong):
        raise DataError(f"{path}: {len(wrong)} line(s) {what}, the first is line {wrong[0] + 1}. {remedy}.")


def _fields(line: str, separator: str | None, columns: int | None = None) -> list[str]:
    """The (first `columns`) fields of a line, without quotes, blanks around them, and an empty one at its end."""
    if separator is None:
        return [part.strip('"') for part in line.split()]
    parts = [part.strip() for part in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    return parts[:columns] if columns or not line.endswith(separator) else parts[:-1]


def _units(line: str, separator: str | None, columns: int) -> list[str]:
    """The units of a line below the header that has nothing else, in brackets or not, one of them known; else none."""
    fields = [field.strip("[]()") for field in _fields(line, separator)]
    plausible = len(fields) == columns and not any(_LIKE_A_NUMBER.match(field) for field in fields if field)
    return fields if plausible and any(field and known_unit(field) for field in fields) else []


@cache
def _row(separator: str | None, columns: int | None = None) -> re.Pattern[str]:
    """A row of so many numbers, or of any, without quotes; decimal commas if the separator is another one."""
    point, times = r"\." if separator == "," else "[.,]", "*" if columns is None else f"{{{columns - 1}}}"
    number = rf"[+-]?(?:\d++(?:{point}\d*+)?|{point}\d++)(?:[eE][+-]?\d++)?"
    if separator is None:
        return re.compile(rf"\s*{number}(?:\s+{number}){times}\s*", re.ASCII)
    return re.compile(rf" *{number} *(?:{separator} *{number} *){times}{separator}? *", re.ASCII)


def _numbers(line: str, separator: str | None, columns: int | None = None) -> bool:
    return _row(separator, columns).fullmatch(line.replace('"', "")) is not None


def _settings(path: Path, comments: list[str]) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    for match in filter(None, map(_SETTING.fullmatch, comments)):
        value = float(match[2]) if _numbers(match[2], ",", 1) else match[2]
        if found.setdefault(match[1], value) != value:
            raise DataError(f"{path}: says {match[1]} = {found[match[1]]} and {value}. Delete the wrong one.")
    return found


def _columns(path: Path, lines: list[str], data: list[int], separator: str | None) -> int:
    """Fields of each of the rows `data`, without an empty last one; gaps between them and other numbers are refused."""
    between = range(data[0], data[-1])
    blank = [i for i in between if not lines[i].strip()]
    _refuse(path, blank, "blank among the samples", "Samples may be missing there: export the record again")
    hidden = [i for i in between if lines[i].startswith("#") and _numbers(lines[i].lstrip("#"), separator)]
    _refuse(path, hidden, "of numbers behind a # among the samples", "Remove it, or delete the line")
    _refuse(path, [i for i in data if "#" in lines[i]], "with a # after its beginning", "Cut it off")
    last = separator is not None and all(lines[i].endswith(separator) for i in data)
    counts = [(lines[i].count(separator) + 1 if separator else len(lines[i].split())) - last for i in data]
    others = [i for i, count in zip(data, counts, strict=True) if count != counts[0]]
    said = f"do not have {counts[0]} fields as line {data[0] + 1} has"
    _refuse(path, others, said, "Values are missing or in the wrong columns there: export the record again")
    return counts[0]


def _check_names(where: str, names: list[str], columns: int, separator: str | None) -> None:
    """Refuse a first line that is no header of so many columns."""
    if wrong := [name for name in names if _LIKE_A_NUMBER.match(name)]:
        raise DataError(
            f"{where} is not a row of numbers, and {printable(wrong[0])!r} not a column name: a name neither is "
            "empty nor begins like a number. Correct the line, or put a # before it if it is neither."
        )
    if len(names) != columns:
        decimals = "; where commas stand between columns, decimals need a point" if separator == "," else ""
        raise DataError(f"{where} has {len(names)} names for {columns} columns. Name each{decimals}.")
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise DataError(f"{where} names more than one column {printable(twice[0])!r}. Give each a name of its own.")


def _table(
    path: Path, lines: list[str], data: list[int], separator: str | None, columns: int
) -> tuple[NDArray[np.float64], bool]:
    """The numbers of the rows `data`, all of them finite, and whether they have decimal commas."""
    import pandas as pd

    body = "\n".join([lines[i] for i in data]).replace('"', "") + "\n"
    comma = _decimal_commas(path, data, body, separator)
    try:
        with _WARNINGS, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            frame = pd.read_csv(
                io.BytesIO(body.encode()),
                sep=separator or r"\s+",
                header=None,
                usecols=range(columns),
                dtype=np.float64,
                index_col=False,
                na_filter=False,
                decimal="," if comma else ".",
            )
        table = frame.to_numpy(dtype=np.float64)
        wrong = [data[i] for i in np.flatnonzero(~np.isfinite(table).all(axis=1))]
    except Exception as error:  # the one border where a hostile file meets foreign code
        wrong = [i for i in data if not _numbers(lines[i], separator, columns)]
        if not wrong:
            raise DataError(f"{path}: cannot be read as a table ({first_line(error)}).") from None
    if wrong:
        fields = _fields(lines[wrong[0]], separator, columns)
        bad = next((part for part in fields if not _numbers(part, separator, 1)), max(fields, key=len))
        _refuse(path, wrong, f"with a field that is not finite ({printable(bad)!r})", "Export the record again")
    return table, comma


def _decimal_commas(path: Path, data: list[int], body: str, separator: str | None) -> bool:
    """True if the numbers have decimal commas; `DataError` if that cannot be decided."""
    point, comma = "." in body, re.search(",", body)
    if separator == ",":
        found = _SPLIT_DECIMAL.search(body) or (None if point else _MINUS_ZERO.search(body))
        what = "has decimal commas that cannot be told from those between columns"
    elif comma and point:
        found, what = comma, "is in a table of both decimal commas and points, or with thousands separators"
    else:
        found = None if _NO_THOUSANDS.search(body) else comma
        what = "has three digits after every comma: decimals or thousands"
    if found:
        before = body[: found.start() + 1].split("\n")
        text = printable(before[-1] + body[found.start() + 1 :].split("\n", 1)[0])
        raise DataError(f"{path}: line {data[len(before) - 1] + 1}, {text!r}, {what}. Export it with decimal points.")
    return comma is not None and separator != ","


def _is_text(head: bytes) -> bool:
    """True without control characters but white space, in any 8-bit encoding, and for UTF-16 with its mark."""
    return head.startswith(UTF16) or not any(byte < 32 and byte not in b"\t\n\r\f" for byte in head)


FORMAT = FileFormat(TEXT, "a text table", _is_text, load_text, trusted=True)
