"""Times at which the files of a machine's history were recorded."""

import contextlib
import csv
import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import read_limited

DATE = re.compile(r"(\d{4})\D?(\d\d)\D?(\d\d)(?:\D?(\d\d)\D?(\d\d)(?:\D?(\d\d))?)?(?!\d)")


def record_times(files: Sequence[str], table: Path | None = None) -> tuple[dict[str, datetime | float], str]:
    """Time of each file, and the source of the times in words.

    Times are read from a CSV `table` with the columns `file` and `time`; without a table from dates in the file names,
    else from the last number in each name, else from the dates of the files' last change. `ConfigurationError` for an
    unusable table.
    """
    names = {file: Path(file).name for file in files}
    if table is not None:
        rows = csv.DictReader(read_limited(table).decode("utf-8-sig", "replace").splitlines())
        try:
            stated = {Path(row["file"]).name: _time(row["time"]) for row in rows}
            return {file: stated[name] for file, name in names.items()}, f"the column time of {table.name}"
        except (KeyError, ValueError, TypeError) as error:
            raise ConfigurationError(
                f"{table}: cannot be used ({error}): it needs the columns file and time, a row for each file, and "
                "times that are dates (2026-11-24 13:55) or numbers."
            ) from None
    dates = {file: match for file, name in names.items() if (match := DATE.search(name))}
    if len(dates) == len(files):
        with contextlib.suppress(ValueError):  # numbers, but no date
            shown = {f: "{}-{}-{}T{}:{}:{}".format(*match.groups("00")) for f, match in dates.items()}
            return {f: datetime.fromisoformat(text) for f, text in shown.items()}, "the files' names"
    numbers = {file: re.findall(r"\d+", Path(name).stem) for file, name in names.items()}
    if all(numbers.values()) and len({float(one[-1]) for one in numbers.values()}) == len(files):
        return {file: float(one[-1]) for file, one in numbers.items()}, "the last number in the files' names"
    try:
        changed: dict[str, datetime | float] = {f: datetime.fromtimestamp(Path(f).stat().st_mtime) for f in files}
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be read ({error.strerror}).") from None
    return changed, "the files' dates of change"


def _time(text: str) -> datetime | float:
    try:
        return float(text)
    except ValueError:
        return datetime.fromisoformat(text.strip())
