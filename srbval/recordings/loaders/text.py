"""Text tables: comma, semicolon, tab or blank separated, with or without a header line."""

import itertools
import re
import threading
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import TEXT, FileFormat, RawFile, first_line

MAX_COLUMNS = 64
HEADER_LINES = 100
MAX_LINE = 16384
_WARNINGS = threading.Lock()  # catch_warnings changes the state of the whole process
_SETTING = re.compile(r"#\s*([A-Za-z_]\w*)\s*[=:]\s*(.+?)\s*")


def load_text(path: Path) -> RawFile:
    """Read the columns of a text table under their header's names, else ``col_1``, ``col_2``, ...

    Lines that begin with ``#`` are comments; ``# fs_hz = 20480`` among the first ones is kept as an
    attribute. Raises `DataError` for anything that is not a table of numbers.
    """
    first, settings = _first_line(path)
    separator = next((mark for mark in (";", "\t", ",") if mark in first), None)
    names = [part.strip().strip('"') for part in (first.split(separator) if separator else first.split())]
    if not 1 <= len(names) <= MAX_COLUMNS:
        raise DataError(f"{path}: {len(names)} columns in the first line; a table has 1 to {MAX_COLUMNS}.")
    has_header = not all(_is_number(part) for part in names)
    if has_header and all(not _is_number(p) for p in names) and len(set(names)) != len(names):
        raise DataError(f"{path}: a text file whose first line, {first[:60]!r}, is no table of numbers.")
    table = _table(path, separator, has_header)
    if len(table) == 0:
        raise DataError(f"{path}: a text file, but not a table of numbers (no line of them after the first).")
    if table.shape[1] != len(names):
        raise DataError(f"{path}: {len(names)} names for {table.shape[1]} columns of numbers.")
    keys = names if has_header else [f"col_{i + 1}" for i in range(len(names))]
    columns = {key: np.ascontiguousarray(table[:, i]) for i, key in enumerate(keys)}
    return RawFile(path=path, format=TEXT, variables=columns, attributes=settings)


def _first_line(path: Path) -> tuple[str, dict[str, float | str]]:
    """First line that is neither blank nor a comment, and the settings among the comments."""
    settings: dict[str, float | str] = {}
    with path.open(encoding="latin-1") as stream:
        for _ in itertools.repeat(None, HEADER_LINES):
            line = stream.readline(MAX_LINE)
            if len(line) >= MAX_LINE:
                raise DataError(f"{path}: a line of more than {MAX_LINE} characters is no table of numbers.")
            if match := _SETTING.fullmatch(line.strip()):
                settings[match[1]] = float(match[2]) if _is_number(match[2]) else match[2]
            elif line.strip() and not line.startswith("#"):
                return line.strip(), settings
    raise DataError(f"{path}: a text file without a line of numbers.")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _table(path: Path, separator: str | None, has_header: bool) -> NDArray[np.float64]:
    import pandas as pd

    try:
        with _WARNINGS, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            frame = pd.read_csv(
                path, sep=separator or r"\s+", header=0 if has_header else None, comment="#", dtype=np.float64,
                encoding="latin-1", skip_blank_lines=True, index_col=False,
            )  # fmt: skip
    except Exception as error:  # the one border where a hostile file meets foreign code
        raise DataError(f"{path}: a text file, but not a table of numbers ({first_line(error)}).") from None
    return frame.to_numpy(dtype=np.float64)


def _is_text(head: bytes) -> bool:
    """Text has no control characters but white space; any 8-bit encoding will do."""
    return not any(byte < 32 and byte not in b"\t\n\r\f" for byte in head)


FORMAT = FileFormat(name=TEXT, description="a text table", matches=_is_text, load=load_text)
