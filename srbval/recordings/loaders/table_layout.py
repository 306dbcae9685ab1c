"""Place of the table in a text: its rows, the kinds of its columns, and their names and units in the lines above."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.raw import printable
from srbval.recordings.times import is_time, stated_rate
from srbval.recordings.units import UNITS, is_unit_key, known_unit, split_unit

TRIED_ROWS = 25  # rows by which the kind of each column is decided
HEADER_LINES = 4  # lines above the table that may contain names and units
_MISSING = re.compile(r"(?:[+-]?nan|null|none|#?n/?a|nil|-{1,3}|[+-]?inf(?:inity)?)?", re.IGNORECASE)
_COLON = re.compile(r"[#\s]*[A-Za-z][\w .()\[\]/-]*?\s*[:=]")
_DECIMAL_NUMBER = re.compile(r"[+-]?(?:\d++(?:[.,]\d*+)*+|[.,]\d++)(?:[eE][+-]?\d++)?", re.ASCII)
_LIKE_A_NUMBER = re.compile(r"[+\-−]?[.,]?\d|(?:[+-]?(?:nan|inf|infinity)|null|none|n/?a)?$", re.IGNORECASE)
_CLOCK = re.compile(r"[^,;]*\d:\d\d?")
_DATE = re.compile(r"\d{4}[-/.]?\d\d[-/.]?\d\d(?:T.*)?|\d{1,2}[./-]\d{1,2}[./-]\d{2,4}|\d{1,2}-[A-Za-z]{3}-\d{2,4}")
_STAMP = re.compile(r"(\d)[ \t]+(\d{1,2}:\d\d:\d\d\S*)(?:[ \t]+([AaPp][Mm]\b))?")
_WITHIN = re.compile(r"[^,]+|[+-]?\d+,\d+(?:[eE][+-]?\d+)?|[\d:T.-]+:\d\d,\d+Z?", re.ASCII)  # a comma within the field


@dataclass(frozen=True, kw_only=True)
class TableLayout:
    """Table found in a text: the fields of its `rows`, and for each row the index of its line in the text (`lines`).

    `separator` is the character between fields, None for blanks. `kinds` contains a letter for each column: ``n``
    numbers, ``t`` clock times, ``d`` dates, ``x`` other texts, ``e`` empty.
    """

    separator: str | None
    lines: list[int]
    rows: list[list[str]]
    kinds: str


def find_table(path: Path, lines: list[str]) -> TableLayout:
    """Find the table: lines with fields of the same kinds (number, text etc.) as the fields of a typical line.

    Changes `lines` in place: removes a statement of the separator, and joins date and time of a time stamp with a T.
    """
    filled = [i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    stated = re.fullmatch(r'"?sep=(.)"?;*', lines[filled[0]]) if filled else None
    if stated:
        lines[filled.pop(0)] = ""
    if not filled:
        raise NoRecordingError(f"{path}: a text file without a table of numbers.")
    middle = lines[filled[len(filled) // 2]]
    if not stated and _separator(middle) is None and _STAMP.search(middle):  # time stamps contain blanks
        lines[:] = [_STAMP.sub(r"\1T\2\3", line) for line in lines]
    for typical in (filled[len(filled) // 2], filled[-1], filled[0]):
        separator = stated[1] if stated else _separator(lines[typical])
        own = "".join(map(classify_field, _fields(lines[typical], separator)))
        if "n" in own:
            break
    rows = [_fields(lines[i], separator) for i in filled]

    def is_row(fields: list[str]) -> bool:
        kinds = "".join(map(classify_field, fields)) if len(fields) == len(own) else ""
        return "n" in kinds and all(
            kind in (usual, "e") or usual in "ex" for kind, usual in zip(kinds, own, strict=True)
        )

    first, last = next((k for k, row in enumerate(rows) if is_row(row)), 0), len(rows)
    tried = [rows[int(k)] for k in np.unique(np.linspace(first, last - 1, TRIED_ROWS).astype(int))]
    is_prose = separator is None and own.count("x") > own.count("n")
    if "n" not in own or is_prose or 2 * sum(map(is_row, tried)) < len(tried):
        shown = next((i for i, row in zip(filled[1:], rows[1:], strict=True) if not is_row(row)), filled[0])
        wrong = f"line {shown + 1} is {printable(lines[shown])!r}"
        raise NoRecordingError(f"{path}: a text file, but not a table of numbers ({wrong}){_hint(separator)}.")
    while last - first > 1 and _counts_up(rows[first]) and any("." in f or "," in f for f in rows[first + 1]):
        first += 1  # the names are numbers
    kinds = [list(map(classify_field, column)) for column in zip(*(row for row in tried if is_row(row)), strict=True)]
    usual = "".join(max("entdx" if set(kind) == {"e"} else "ntdx", key=kind.count) for kind in kinds)
    while usual[0] in "nt" and last - first > 1 and classify_field(begin := rows[last - 1][0]) == "x":
        if _LIKE_A_NUMBER.match(begin):
            break
        last -= 1  # a line below the table
    return TableLayout(separator=separator, lines=filled[first:last], rows=rows[first:last], kinds=usual)


def _counts_up(fields: list[str]) -> bool:
    """True for the column names 0, 1, 2, ... that pandas writes, with or without an empty field before them."""
    counted_names = [str(i) for i in range(len(fields))]
    return fields in (counted_names, ["", *counted_names[:-1]])


def _separator(line: str) -> str | None:
    """Character that separates the fields of a line; None for blanks."""
    mark = next((mark for mark in (";", "\t", "|", ",") if mark in line), None)
    parts = line.split()
    return None if mark == "," and len(parts) > 1 and all(map(_WITHIN.fullmatch, parts)) else mark


def _fields(line: str, separator: str | None) -> list[str]:
    """Split a line into fields; remove quotes, blanks around fields, and an empty field at the end."""
    if separator is None:
        return [part.strip('"') for part in line.split()]
    split = csv.reader([line], delimiter=separator, skipinitialspace=True) if '"' in line else [line.split(separator)]
    parts = [part.strip() for part in next(iter(split))]
    return parts[:-1] if line.endswith(separator) else parts


def classify_field(field: str) -> str:
    """Kind of a field: ``n`` number, ``t`` clock time, ``d`` date, ``e`` empty, ``x`` other text."""
    if _DECIMAL_NUMBER.fullmatch(field):
        return "n"
    if _MISSING.fullmatch(field):
        return "e"
    return "t" if ":" in field and _CLOCK.match(field) else "d" if _DATE.fullmatch(field) else "x"


def check_rows(path: Path, lines: list[str], table: TableLayout) -> None:
    """Add or drop empty fields at ends of rows; `DataError` for unequal lengths and lines that may be lost rows."""
    separator, first, columns = table.separator, table.lines[0], len(table.kinds)

    def has_numbers_only(line: str) -> bool:
        kinds = {classify_field(field) for field in _fields(line, separator)} if line.strip() else set()
        return "n" in kinds and kinds <= {"n", "e"}

    rows = dict(zip(table.lines, table.rows, strict=True))
    for row in table.rows:
        while len(row) > columns and not row[-1]:
            row.pop()
        if separator and len(row) == columns - 1 and table.kinds[-1] == "e":
            row.append("")

    def is_wrong(i: int) -> bool:
        if i in rows:
            return len(rows[i]) != columns or ("#" in lines[i] and "#N/A" not in lines[i])
        return not lines[i].strip() or has_numbers_only(lines[i].lstrip("#"))

    wrong = [i for i in range(first, table.lines[-1] + 1) if is_wrong(i)]
    what = f"among the samples are blank, contain a # or do not have {columns} fields as line {first + 1} has"
    remedy = f"Values are missing or in the wrong columns there: export the record again{_hint(separator)}"
    refuse(path, wrong, what, remedy)
    above = [i for i in range(first) if has_numbers_only(lines[i]) and not _counts_up(_fields(lines[i], separator))]
    refuse(path, above, "of numbers above the table do not fit its columns", "Correct them, or put a # before them")


def _hint(separator: str | None) -> str:
    return "; if commas separate columns, decimals need a point" if separator == "," else ""


def read_header(path: Path, above: list[str], table: TableLayout) -> tuple[list[str], list[str], set[int]]:
    """Names and units of the columns (empty if not stated), and the indices of the lines that state them."""
    names, units, used = list[str](), list[str](), set[int]()
    columns, separator = len(table.kinds), table.separator
    for i in reversed([i for i, line in enumerate(above) if line.strip("# \t;,|")][-HEADER_LINES:]):
        comment, line = above[i].startswith("#"), above[i].lstrip("# ")
        fields = _names_of(line, separator, columns)
        if fields is None and i == len(above) - 1 and not comment and not _COLON.match(line):
            wrong = f"line {i + 1} has {len(_fields(line, separator))} names for {columns} columns"
            raise DataError(f"{path}: {wrong}. Give each column a name{_hint(separator)}.")
        if fields is None or (columns == 1 and _COLON.match(line)) or _is_statement(fields):
            break
        if comment and not any(is_time(field) or known_unit(split_unit(field)[1] or "") for field in fields):
            break
        bare = [field.strip("[]()") for field in fields]
        meant = [known_unit(field) or is_time("", field) for field in bare if field]
        plausible = not any(_LIKE_A_NUMBER.match(field) for field in bare if field)
        if not units and plausible and any(one in UNITS for one in meant) and sum(map(bool, meant)) * 2 >= len(meant):
            units, used = bare, used | {i}
        elif not names:
            _check_names(f"{path}: line {i + 1}", fields, table)
            names, used = fields, used | {i}
        else:
            break
    blank = [""] * columns
    return names or units or blank, units if names and units else blank, used


def _names_of(line: str, separator: str | None, columns: int) -> list[str] | None:
    """Split a line into names, one for each of the `columns`, by any usual separator; None if this fails."""
    tried = [_fields(line, separator)]
    if separator is not None and line.endswith(separator):
        tried.append([*tried[0], ""])
    if columns == 1 and not re.search(r"[;\t|]", line):
        tried.append([line.strip('"')])
    if separator is None:
        tried += [re.split(r"\s{2,}|\t", line), re.split(r"\s*[;,]\s*", line), re.split(r"\s+(?![\[(])", line)]
        tried += [fields[1:] for fields in tried if fields[0].lower() == "date"]  # joined with the time of day
    return next((fields for fields in tried if len(fields) == columns), None)


def _is_statement(fields: list[str]) -> bool:
    """True if the `fields` of a line are a setting and its value, such as a sampling rate, instead of column names."""
    first, rest = fields[0].rstrip(": "), [field for field in fields[1:] if field]
    is_value = len(rest) == 1 and bool(_DECIMAL_NUMBER.match(rest[0])) and not _LIKE_A_NUMBER.match(first)
    return len(fields) > 1 and (is_value or is_unit_key(first) or any(stated_rate(first, value) for value in rest[:1]))


def _check_names(where: str, names: list[str], table: TableLayout) -> None:
    """Raise `DataError` if a name of a column of numbers or times looks like a number or is not unique."""
    needed = [name for i, name in enumerate(names) if table.kinds[i] in "ntd" and (name or i)]
    if wrong := [name for name in needed if _LIKE_A_NUMBER.match(name) and not _counts_up(names)]:
        raise DataError(
            f"{where} is not a row of numbers, and {printable(wrong[0])!r} is not a column name: a name is not empty "
            f"and does not begin like a number{_hint(table.separator)}. Correct the line, or put a # before it."
        )
    if twice := sorted({name for name in needed if names.count(name) > 1}):
        raise DataError(f"{where} names more than one column {printable(twice[0])!r}. Give each column its own name.")


def refuse(path: Path, wrong: list[int], what: str, remedy: str) -> None:
    """Raise `DataError` if `wrong`, the indices of lines with a fault, is not empty; `what` describes the fault."""
    if wrong:
        raise DataError(f"{path}: {len(wrong)} line(s) {what}, the first is line {wrong[0] + 1}. {remedy}.")
