"""A table of labels: one row per file of a campaign of measurements, with what is known of it."""

import csv
import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, did_you_mean
from srbval.recordings.settings import RecordingSettings
from srbval.storage.files import read_limited
from srbval.storage.tables import build

FILE = "file"
COLUMNS = (FILE, *(field.name for field in fields(RecordingSettings)))
ALIASES = {"fs": "fs_hz", "sensitivity": "sensitivity_mv_per_g"}  # as the options of `srbval data add` are called
NUMBERS = tuple(field.name for field in fields(RecordingSettings) if "float" in str(field.type))


def label_table(table: Path, folder: Path, common: RecordingSettings) -> Mapping[Path, RecordingSettings]:
    """Settings by file, from a CSV whose header has ``file`` and any of `COLUMNS`; an empty field leaves `common`.

    Separated by commas, semicolons or tabs; with the latter two, decimals may have a comma. Paths are below `folder`.
    Raises `ConfigurationError` that lists everything that is wrong with the table.
    """
    lines = read_limited(table).decode("utf-8-sig", "replace").splitlines()
    rows = [line for line in lines if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t") if rows and mark in rows[0]), ",")
    header, *body = list(csv.reader(rows, delimiter=separator, skipinitialspace=True)) or [[]]
    names = [ALIASES.get(name.strip().lower(), name.strip().lower()) for name in header]
    wrong = [f"unknown column {name!r}{did_you_mean(name, COLUMNS)}" for name in names if name not in COLUMNS]
    if FILE not in names or len(set(names)) < len(names):
        wrong.append(f"each of its columns must be there once, {FILE!r} among them")
    if wrong or not body:
        raise ConfigurationError(f"{table}: {'; '.join(wrong) or 'no row below its header'}.")
    found: dict[Path, RecordingSettings] = {}
    for number, row in enumerate(body, 1):
        try:
            if len(row) != len(names):
                raise ConfigurationError(f"{len(row)} fields where the header has {len(names)}")
            stated: dict[str, Any] = {k: v.strip() for k, v in zip(names, row, strict=True) if v.strip() or k == FILE}
            file = Path(os.path.abspath(folder / stated.pop(FILE)))
            if not file.is_file():
                raise ConfigurationError(f"{file}: no such file")
            for key in set(stated) & set(NUMBERS) if separator != "," else ():
                stated[key] = stated[key].replace(",", ".")
            settings = build(RecordingSettings, stated, "row")
            if file in found:
                raise ConfigurationError(f"{file.name} is named twice")
            found[file] = settings.over(common)
        except ConfigurationError as error:
            wrong.append(f"row {number}: {error}")
    if wrong:
        raise ConfigurationError(f"{table}: {len(wrong)} of {len(body)} rows cannot be used: {'; '.join(wrong)}")
    return found
