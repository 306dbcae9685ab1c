"""Loader for tables in text files; lines above the table, column names, units, times and texts are optional."""

import codecs
import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.loaders.table_layout import (
    TableLayout,
    check_rows,
    classify_field,
    find_table,
    read_header,
    refuse,
)
from srbval.recordings.raw import LONGEST_NAME, ArrayOrText, RawFile, first_line, printable
from srbval.recordings.times import is_rising, parse_time_stamps, read_counter, stated_rate
from srbval.recordings.units import is_unit_key

NOTE_CHARACTERS = 1024  # characters of a note; of the beginning of a text by which its kind is found
LARGEST_TEXT = 500 * 10**6  # bytes, if every line is examined
END_BYTES = 2**18  # of a long text of plain numbers, only this much at both ends is examined line by line
BLOCK_BYTES = 2**24  # of a long text that are converted at once
FEW_ROWS, MANY_FIELDS = 64, 256  # if a table has fewer rows and more fields, each row is a channel
UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_CONTROL = re.compile(r"[\0-\x08\x0b\x0d-\x1f]")
_COMMENT = re.compile(r"^(?:%|//)")
_KEY = re.compile(r'[#\s"]*([A-Za-z][^:=;,\t]{0,60}?)"?\s*(?:[:=;,\t]\s*)+"?(.+?)[\s";,]*')
_PLAIN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf(?:inity)?", re.ASCII | re.IGNORECASE)
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
    table = find_table(path, lines)
    above = lines[: table.lines[0]]
    if len(table.kinds) >= MANY_FIELDS and len(table.rows) <= FEW_ROWS:
        names = [row[0] if classify_field(row[0]) == "x" else "" for row in table.rows]
        units, used = [""] * len(names), set[int]()
        columns = [row[bool(name) :] for row, name in zip(table.rows, names, strict=True)]
        kinds = "n" * len(columns)
        notes += (f"{len(columns)} row(s) of many numbers, each read as a channel",)
    else:
        check_rows(path, lines, table)
        names, units, used = read_header(path, above, table)
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
    refuse(path, wrong, "with control characters", "Copy the damaged file again")
    return lines, () if text.endswith("\n") else ("the last line has no end: the file may have been cut there",)


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
