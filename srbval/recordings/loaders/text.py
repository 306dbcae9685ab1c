"""Loader for tables in text files; lines above the table, column names, units, times and texts are optional."""

import codecs
import contextlib
import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.raw import LONGEST_NAME, ArrayOrText, RawFile, first_line, printable
from srbval.recordings.times import is_rising, is_time, parse_time_stamps, read_counter, stated_rate
from srbval.recordings.units import UNITS, is_unit_key, known_unit, split_unit

NOTE_CHARACTERS = 1024  # characters of a note; of the beginning of a text by which its kind is found
LARGEST_TEXT = 500 * 10**6  # bytes, if every line is examined
END_BYTES = 2**18  # of a long text of plain numbers, only this much at both ends is examined line by line
BLOCK_BYTES = 2**24  # of a long text that are converted at once
FEW_ROWS, MANY_FIELDS = 64, 256  # if a table has fewer rows and more fields, each row is a channel
TRIED_ROWS = 25  # rows by which the kind of each column is decided
HEADER_LINES = 4  # lines above the table that may contain names and units
UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_MISSING = re.compile(r"(?:[+-]?nan|null|none|#?n/?a|nil|-{1,3}|[+-]?inf(?:inity)?)?", re.IGNORECASE)
_CONTROL = re.compile(r"[\0-\x08\x0b\x0d-\x1f]")
_COMMENT = re.compile(r"^(?:%|//)")
_KEY = re.compile(r'[#\s"]*([A-Za-z][^:=;,\t]{0,60}?)"?\s*(?:[:=;,\t]\s*)+"?(.+?)[\s";,]*')
_COLON = re.compile(r"[#\s]*[A-Za-z][\w .()\[\]/-]*?\s*[:=]")
_DECIMAL_NUMBER = re.compile(r"[+-]?(?:\d++(?:[.,]\d*+)*+|[.,]\d++)(?:[eE][+-]?\d++)?", re.ASCII)
_PLAIN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf(?:inity)?", re.ASCII | re.IGNORECASE)
_LIKE_A_NUMBER = re.compile(r"[+\-−]?[.,]?\d|(?:[+-]?(?:nan|inf|infinity)|null|none|n/?a)?$", re.IGNORECASE)
_CLOCK = re.compile(r"[^,;]*\d:\d\d?")
_DATE = re.compile(r"\d{4}[-/.]?\d\d[-/.]?\d\d(?:T.*)?|\d{1,2}[./-]\d{1,2}[./-]\d{2,4}|\d{1,2}-[A-Za-z]{3}-\d{2,4}")
_STAMP = re.compile(r"(\d)[ \t]+(\d{1,2}:\d\d:\d\d\S*)(?:[ \t]+([AaPp][Mm]\b))?")
_WITHIN = re.compile(r"[^,]+|[+-]?\d+,\d+(?:[eE][+-]?\d+)?|[\d:T.-]+:\d\d,\d+Z?", re.ASCII)  # a comma within the field
_NO_THOUSANDS = re.compile(r"(?<!\d)0,\d|,\d{1,2}(?!\d)|,\d{4}")
_SPLIT_DECIMAL = re.compile(r"[+-]?0\d+")
_AMBIGUOUS = re.compile(rb"(?<![\d.eE+-])(?:[+-]?0\d|-0(?![.\d]))")  # fields that `_has_decimal_commas` may refuse
# Texts that are no tables, by their beginnings, with advice.
OTHER_TEXTS = {
    r"version https://git-lfs": "a Git LFS pointer, not the data. Fetch the data: git lfs pull",
    r"\S*annex/objects/": "a git-annex pointer, not the data. Fetch the data: git annex get",
    r"<(?:!doctype\s+html|html|head|body)": "an HTML page, not the data. Download the file itself",
    r"<(?:\?xml|[a-z])": "an XML document, no table. Export the record as CSV",
}


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


def load_text(path: Path) -> RawFile:
    """Read the columns of a text table by the names in its header, else as ``col_1``, ``col_2``, ...

    Lines above the table may state rate, unit and speed (``Sampling rate [Hz]: 12000``, ``# fs_hz = 20480``); lines
    that begin with ``#``, ``%`` or ``//`` are comments. Time stamps become seconds; texts and empty columns are left
    out. Decimal commas are read if they cannot be separators. A column with fields that are not finite numbers is in
    `RawFile.unusable`. Each row is a channel in a table of at most `FEW_ROWS` rows and at least `MANY_FIELDS` columns.
    Raises `DataError` if rows differ in layout.
    """
    size = path.stat().st_size
    if size > 4 * END_BYTES:
        with path.open("rb") as stream:
            head = stream.read(END_BYTES)
            stream.seek(size - END_BYTES)
            tail = stream.read()
        begin, end = head.rfind(b"\n") + 1, tail.find(b"\n") + 1
        if begin and end and not head.startswith(UTF16):
            middle = _read_blocks(path, begin, size - END_BYTES + end)
            with contextlib.suppress(DataError, ValueError):  # irregular: each line is examined below
                return _load_lines(path, head[:begin] + tail[end:], head.count(b"\n"), middle)
    if size > LARGEST_TEXT:
        raise DataError(
            f"{path}: a text file of {size / 1e6:.0f} MB that is no regular table of plain numbers; the limit is then "
            f"{LARGEST_TEXT / 1e6:g} MB, as reading takes 40 times the size in memory. Export it as .npy, .wav, HDF5, "
            "TDMS or Parquet, or in parts."
        )
    return _load_lines(path, path.read_bytes())


def _load_lines(path: Path, content: bytes, cut: int = 0, middle: Iterator[bytes] | None = None) -> RawFile:
    """Read a table from `content`; the lines in `middle`, if given, belong after the first `cut` lines of `content`.

    Raises `ValueError` if a line in `middle` is not a row of finite numbers of the same layout.
    """
    lines, notes = _read_lines(path, content)
    table = _find_table(path, lines)
    above = lines[: table.lines[0]]
    if len(table.kinds) >= MANY_FIELDS and len(table.rows) <= FEW_ROWS:
        names = [row[0] if _classify_field(row[0]) == "x" else "" for row in table.rows]
        units, used = [""] * len(names), set[int]()
        columns = [row[bool(name) :] for row, name in zip(table.rows, names, strict=True)]
        kinds = "n" * len(columns)
        notes += (f"{len(columns)} row(s) of many numbers, each read as a channel",)
    else:
        _check_rows(path, lines, table)
        names, units, used = _header(path, above, table)
        columns, kinds = [list(column) for column in zip(*table.rows, strict=True)], table.kinds
    comma = _has_decimal_commas(path, columns, kinds, table)
    cut_row, cut_out = 0, list[NDArray[np.float64]]()
    if middle is not None:
        cut_row = table.lines.index(cut)
        if table.lines[cut_row - 1] != cut - 1 or len(columns) < len(table.kinds):  # or each row may be a channel
            raise ValueError("not one table")
        cut_out = [_read_regular(block, table, comma=comma) for block in middle]
    variables: dict[str, ArrayOrText] = {}
    said: dict[str, str] = {}
    unusable: dict[str, str] = {}
    left = []
    for i, (name, fields) in enumerate(zip(names, columns, strict=True)):
        key, wrong = name[:LONGEST_NAME] or f"col_{i + 1}", ""
        if kinds[i] == "t" or (kinds[i] == "d" and "t" not in kinds):
            stamps = fields
            if kinds.count("d") == kinds.count("t") and re.match(r"\d{1,2}:", fields[0]):  # dates in another column
                stamps = [f"{day} {time}" for day, time in zip(columns[kinds.index("d")], fields, strict=True)]
            if (times := parse_time_stamps(stamps)) is None:
                wrong = f"the times of {printable(key)} are not understood ({printable(fields[0])!r})"
            values, said[key] = np.full(len(fields), np.nan) if times is None else times, "s"
        elif kinds[i] in "ne" and not np.isnan(values := _parse_numbers(fields, comma=comma)).all():
            if (bad := np.flatnonzero(~np.isfinite(values))).size:
                line, field = table.lines[min(int(bad[0]), len(table.lines) - 1)] + 1, printable(fields[int(bad[0])])
                wrong = f"{bad.size} line(s) with a field that is not finite ({field!r}) in {printable(key)}, "
                wrong += f"the first is line {line}. Export the record again."
            values = np.concatenate([values[:cut_row], *(block[:, i] for block in cut_out), values[cut_row:]])
        else:
            left += [printable(name)] if name and kinds[i] != "d" else []
            continue
        if not any(names) and i == 0 and len(columns) > 1 and is_rising(values) and read_counter(values) is None:
            key = "time"
        variables[key] = values
        said |= {key: units[i]} if key not in said and any(map(str.isalpha, units[i])) else {}
        unusable |= {key: wrong} if wrong else {}
    if unusable and middle is not None:
        raise ValueError("line numbers differ")
    notes += ("decimal commas read as decimal points",) if comma else ()
    notes += (f"left out, no numbers: {', '.join(left)[:NOTE_CHARACTERS]}",) if left else ()
    below = sum(bool(line.strip("# ")) for line in lines[table.lines[-1] + 1 :])
    notes += (f"left out: {below} line(s) below the table",) if below else ()
    facts = _read_statements(path, [line for i, line in enumerate(above) if i not in used])
    return RawFile(path=path, variables=variables, attributes=facts, notes=notes, units=said, unusable=unusable)


def _read_blocks(path: Path, begin: int, end: int) -> Iterator[bytes]:
    """Yield the lines of a file between the bytes `begin` and `end`, in blocks of whole lines."""
    with path.open("rb") as stream:
        stream.seek(begin)
        while (left := end - stream.tell()) > 0:
            yield stream.read(min(left, BLOCK_BYTES)) + (stream.readline() if left > BLOCK_BYTES else b"")


def _read_regular(block: bytes, table: TableLayout, *, comma: bool) -> NDArray[np.float64]:
    """Convert lines to an array [rows, columns]; `ValueError` unless all are rows of finite numbers as in `table`.

    The lines are not examined one by one. Only separators and the characters of plain numbers are permitted, so that
    no comment, quote, time, missing value or thousands separator is overlooked.
    """
    allowed = b"0123456789+-eE\r\n " + (b"," if comma else b".") + (table.separator or " \t").encode()
    if set(table.kinds) != {"n"} or block.translate(None, allowed):
        raise ValueError("not only numbers")
    if table.separator == "," and _AMBIGUOUS.search(block):
        raise ValueError("perhaps decimal commas")
    text = io.BytesIO(block.replace(b",", b".") if comma else block)
    numbers = np.loadtxt(text, np.float64, comments=None, delimiter=table.separator, ndmin=2)
    if numbers.shape != (block.count(b"\n"), len(table.kinds)) or not np.isfinite(numbers).all():
        raise ValueError("field without number")
    return numbers


def _read_lines(path: Path, content: bytes) -> tuple[list[str], tuple[str, ...]]:
    """Lines of the text without surrounding blanks, and a note if the last one does not end with a line break."""
    try:
        text = content.decode("utf-16" if content.startswith(UTF16) else "utf-8-sig")
    except UnicodeError as error:
        if content.startswith(UTF16):
            raise DataError(f"{path}: damaged UTF-16 text ({first_line(error)}). Save it as UTF-8.") from None
        text = content.decode("latin-1")
    for beginning, what in OTHER_TEXTS.items():
        if re.match(rf"\s*(?:{beginning})", text[:NOTE_CHARACTERS], re.IGNORECASE):
            raise (DataError if "pointer" in what else NoRecordingError)(f"{path}: {what}.")
    text = re.sub("\r+\n", "\n", text) if "\r" in text else text
    text = text if "\n" in text else text.replace("\r", "\n")
    lines = [_COMMENT.sub("#", line.strip(" \f")) for line in text.split("\n")]
    wrong = [i for i, line in enumerate(lines) if _CONTROL.search(line)] if _CONTROL.search(text) else []
    _refuse(path, wrong, "with control characters", "Copy the damaged file again")
    return lines, () if text.endswith("\n") else ("the last line has no end: the file may have been cut there",)


def _refuse(path: Path, wrong: list[int], what: str, remedy: str) -> None:
    """Raise `DataError` if `wrong`, the indices of lines with a fault, is not empty; `what` describes the fault."""
    if wrong:
        raise DataError(f"{path}: {len(wrong)} line(s) {what}, the first is line {wrong[0] + 1}. {remedy}.")


def _find_table(path: Path, lines: list[str]) -> TableLayout:
    """Find the table: lines with fields of the same kinds (number, text etc.) as the fields of a typical line."""
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
        own = "".join(map(_classify_field, _fields(lines[typical], separator)))
        if "n" in own:
            break
    rows = [_fields(lines[i], separator) for i in filled]

    def is_row(fields: list[str]) -> bool:
        kinds = "".join(map(_classify_field, fields)) if len(fields) == len(own) else ""
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
    kinds = [list(map(_classify_field, column)) for column in zip(*(row for row in tried if is_row(row)), strict=True)]
    usual = "".join(max("entdx" if set(kind) == {"e"} else "ntdx", key=kind.count) for kind in kinds)
    while usual[0] in "nt" and last - first > 1 and _classify_field(begin := rows[last - 1][0]) == "x":
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


def _classify_field(field: str) -> str:
    """Kind of a field: ``n`` number, ``t`` clock time, ``d`` date, ``e`` empty, ``x`` other text."""
    if _DECIMAL_NUMBER.fullmatch(field):
        return "n"
    if _MISSING.fullmatch(field):
        return "e"
    return "t" if ":" in field and _CLOCK.match(field) else "d" if _DATE.fullmatch(field) else "x"


def _check_rows(path: Path, lines: list[str], table: TableLayout) -> None:
    """Add or drop empty fields at ends of rows; `DataError` for unequal lengths and lines that may be lost rows."""
    separator, first, columns = table.separator, table.lines[0], len(table.kinds)

    def has_numbers_only(line: str) -> bool:
        kinds = {_classify_field(field) for field in _fields(line, separator)} if line.strip() else set()
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
    _refuse(path, wrong, what, remedy)
    above = [i for i in range(first) if has_numbers_only(lines[i]) and not _counts_up(_fields(lines[i], separator))]
    _refuse(path, above, "of numbers above the table do not fit its columns", "Correct them, or put a # before them")


def _hint(separator: str | None) -> str:
    return "; if commas separate columns, decimals need a point" if separator == "," else ""


def _header(path: Path, above: list[str], table: TableLayout) -> tuple[list[str], list[str], set[int]]:
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


def _read_statements(path: Path, above: list[str]) -> dict[str, float | str]:
    """Facts stated as ``name: value`` in lines above the table."""
    found: dict[str, float | str] = {}
    for match in filter(None, map(_KEY.fullmatch, above)):
        key = "unit" if is_unit_key(match[1]) else match[1]
        value = float(match[2]) if re.fullmatch(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?", match[2]) else match[2]
        if found.setdefault(key, value) != value and (key == "unit" or stated_rate(key, value)):
            raise DataError(f"{path}: states {key} = {found[key]} and {value}. Delete the wrong one.")
    return found


def _parse_numbers(fields: list[str], *, comma: bool) -> NDArray[np.float64]:
    """Convert fields to numbers, with decimal commas if `comma`; NaN for any other text."""
    texts = [field.replace(",", ".") for field in fields] if comma else fields
    return np.array([text if _PLAIN.fullmatch(text) else "nan" for text in texts], np.float64)


def _has_decimal_commas(path: Path, columns: list[list[str]], kinds: str, table: TableLayout) -> bool:
    """True if the numbers have decimal commas; `DataError` if the commas are ambiguous."""
    numeric = [column for column, kind in zip(columns, kinds, strict=True) if kind in "ne"]
    places = [(i, field) for column in numeric for i, field in enumerate(column)]
    found = [(i, field) for i, field in places if "," in field]
    points = any("." in field for column in numeric for field in column)
    what, wrong = "", list[tuple[int, str]]()
    if table.separator == "," and not found:
        what = "has decimal commas that cannot be distinguished from commas between columns"
        wrong = [(i, f) for i, f in places if _SPLIT_DECIMAL.fullmatch(f) or (f == "-0" and not points)]
    elif found and points:
        what, wrong = "is in a table of both decimal commas and points, or with thousands separators", found
    elif found and not any(_NO_THOUSANDS.search(field) for _, field in found):
        what, wrong = "has three digits after every comma, which may mean decimals or thousands", found
    if wrong:
        line = table.lines[min(wrong[0][0], len(table.lines) - 1)]
        text = printable((table.separator or " ").join(table.rows[min(wrong[0][0], len(table.rows) - 1)]))
        raise DataError(f"{path}: line {line + 1}, {text!r}, {what}. Export it with decimal points.")
    return bool(found)
