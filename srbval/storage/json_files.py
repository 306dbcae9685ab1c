"""Strict JSON files: NaN and infinity become null; a file is written completely or not at all.

A dataclass is written as an object of its fields, in their order; `tables.build` reads it again. Its class attribute
`JSON_PROPERTIES` names properties that are written after the fields, `JSON_OMITTED` fields that are omitted. A class
whose JSON object has another form has a method ``to_dict()``, which returns a mapping.
"""

import dataclasses
import enum
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError, SrbvalError
from srbval.storage.files import MAX_FILE_BYTES, atomic_write, file_sha256, read_limited


def to_json(value: Any) -> Any:
    """Convert dataclasses, mappings, NumPy values, enums, paths and dates to JSON types; NaN becomes None."""
    if isinstance(value, enum.Enum):
        return to_json(value.value)
    if isinstance(value, np.ndarray | np.generic):
        return to_json(value.tolist())
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        table = {key.value if isinstance(key, enum.Enum) else key: to_json(item) for key, item in value.items()}
        if strange := [key for key in table if not isinstance(key, str)]:
            raise TypeError(f"JSON key {strange[0]!r} must be text.")
        return table
    if isinstance(value, tuple | list):
        return [to_json(item) for item in value]
    if hasattr(value, "to_dict"):
        return to_json(value.to_dict())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        omitted = getattr(value, "JSON_OMITTED", ())
        fields = [field.name for field in dataclasses.fields(value) if field.name not in omitted]
        names = (*fields, *getattr(value, "JSON_PROPERTIES", ()))
        return {name: to_json(getattr(value, name)) for name in names}
    raise TypeError(f"{type(value).__name__} cannot be written as JSON.")


def json_text(value: Any, *, ascii_only: bool = False) -> str:
    """JSON document, indented by two spaces, keys in the given order, a newline at the end."""
    return json.dumps(to_json(value), indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n"


def rows_text(content: Mapping[str, Any]) -> str:
    """JSON text of `content`; a list in it has one line per element: half the size of `json_text`, easy to compare."""
    text = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode
    items = (
        f"{text(key)}: " + ("[\n" + ",\n".join(map(text, value)) + "\n]" if isinstance(value, list) else text(value))
        for key, value in to_json(content).items()
    )
    return "{" + ",\n".join(items) + "}\n"


def parse_json(text: str | bytes) -> Any:
    """Parse a JSON document that may be damaged; raises `ValueError` also for NaN, infinities and deep nesting."""

    def refuse(constant: str) -> Any:
        raise ValueError(f"{constant} is not JSON")

    try:
        return json.loads(text, parse_constant=refuse)
    except RecursionError:
        raise ValueError("nested too deep") from None


def write_json(path: Path, value: Any, text: Callable[[Any], str] = json_text) -> None:
    """Write `value`, formatted by `text`, to `path`; a reader sees the old file or the new file, never a part."""
    # A lone surrogate of a damaged file name becomes its own JSON escape.
    content = text(value).encode("utf-8", errors="backslashreplace")
    with atomic_write(path) as part:
        part.write_bytes(content)


def read_json(path: Path, most_bytes: int = MAX_FILE_BYTES) -> Any:
    """Read a JSON file of at most `most_bytes`; raises `DataError` if it cannot be read or is not JSON."""
    content = read_limited(path, most_bytes)
    try:
        return parse_json(content)
    except ValueError as error:
        raise DataError(f"{path}: not JSON ({error}).") from None


def move_listed_files(stage: Path, folder: Path, listing: str, content: Mapping[str, Any] | None) -> None:
    """Move all files of folder `stage` to `folder`, and write the file `listing`: `content` and each file's SHA-256.

    Files that an earlier call wrote and listed in `folder`, but that are not written now, are removed, unless the user
    has changed them. If `content` is None, no listing is written.
    """
    files = sorted(path for path in stage.rglob("*") if path.is_file())
    if content is not None:
        written = {path.relative_to(stage).as_posix(): file_sha256(path) for path in files}
        write_json(stage / listing, {**content, "files": written})
        files.append(stage / listing)
    stale = set(_listed_files(folder, listing))
    for path in files:
        moved = folder / path.relative_to(stage)
        moved.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, moved)
        stale.discard(moved)
    for path in stale:
        path.unlink(missing_ok=True)


def _listed_files(folder: Path, listing: str) -> Iterator[Path]:
    """Yield the file `listing` in `folder`, and the files it lists that still match their SHA-256."""
    try:
        listed = dict(read_json(folder / listing)["files"])
    except (SrbvalError, LookupError, TypeError, ValueError):  # missing, or written by another program
        return
    yield folder / listing
    for name, sha256 in listed.items():
        inside = ".." not in Path(name).parts and not Path(name).is_absolute() and len(Path(name).parts) <= 2
        if inside and (folder / name).is_file() and file_sha256(folder / name) == sha256:
            yield folder / name
