"""Loaders for files of named arrays: NumPy (pickled objects are never opened), Parquet, Feather and JSON."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.raw import LONGEST_NAME, ArrayOrText, RawFile, first_line
from srbval.recordings.times import is_time, parse_time_stamps
from srbval.recordings.units import is_unit_key

PARQUET = b"PAR1"


def load_npy(path: Path) -> RawFile:
    """Memory-map the array of a .npy file as ``data``; `DataError` if its header contradicts the file's size."""
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # a damaged file may raise anything in a library
        raise DataError(f"{path}: truncated or unusable .npy file ({first_line(error)}). Save plain numbers.") from None
    if values.dtype.kind not in "fiu":
        raise DataError(f"{path}: contains {values.dtype} values; real numbers are needed.")
    if values.nbytes != (held := path.stat().st_size - values.offset):
        size = " x ".join(map(str, values.shape))[:LONGEST_NAME]
        claimed = f"{size} values ({values.dtype}) in {held} bytes"
        raise DataError(f"{path}: truncated or damaged: its header claims {claimed}. Copy it again.")
    return RawFile(path=path, variables={"data": values})


def load_npz(path: Path) -> RawFile:
    """Read every array of an .npz archive by name; an array of one text becomes a text, Python objects are skipped."""
    variables: dict[str, ArrayOrText] = {}
    left = []
    with np.load(path, allow_pickle=False) as arrays:
        for name in [member.removesuffix(".npy") for member in arrays.zip.namelist() if member.endswith(".npy")]:
            try:
                array = arrays[name]
                variables[name] = str(array.flat[0]) if array.dtype.kind == "U" and array.size == 1 else array
            except ValueError as error:  # objects, which would have to be unpickled
                if "allow_pickle" not in str(error):
                    raise
                left.append(name)
    if not variables and not left:
        raise DataError(f"{path}: a ZIP archive without NumPy arrays. Export Excel workbooks as CSV, unpack others.")
    notes = (f"left out, no plain numbers: {', '.join(left)[:LONGEST_NAME]}",) if left else ()
    return RawFile(path=path, variables=variables, notes=notes)


def load_table(path: Path) -> RawFile:
    """Read the columns of a Parquet or Feather file that contain numbers, times or lists of numbers."""
    import pyarrow
    from pyarrow import parquet, types

    def readable(schema: Any) -> list[str]:
        fits = (types.is_integer, types.is_floating, types.is_decimal, types.is_temporal, types.is_list)
        names = [f.name for f in schema if any(fit(f.type) for fit in fits) or is_time(f.name)]
        if twice := [name for i, name in enumerate(names) if name in names[:i]]:
            raise DataError(f"{path}: several columns have the name {twice[0][:80]!r}: give each its own name.")
        return names

    with path.open("rb") as stream:
        is_parquet = stream.read(len(PARQUET)) == PARQUET
    if is_parquet:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            table = file.read(columns=readable(file.schema_arrow), use_threads=False)
    else:
        options = pyarrow.ipc.IpcReadOptions(use_threads=False)
        with pyarrow.OSFile(str(path)) as source, pyarrow.ipc.open_file(source, options=options) as file:
            table = file.read_all()
            table = table.select(readable(table.schema))
    table.validate(full=True)
    stated = ((f.name, key.decode(), value.decode()) for f in table.schema for key, value in (f.metadata or {}).items())
    units = {name: value for name, key, value in stated if is_unit_key(key)}
    facts = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
    raw, form = _of_frame(path, table.to_pandas(ignore_metadata=True)), "Parquet" if is_parquet else "Feather"
    return replace(raw, format=form, attributes={**raw.attributes, **facts}, units={**units, **raw.units})


def load_json(path: Path) -> RawFile:
    """Read JSON or JSON Lines: lists of samples, or objects with samples and the time of the first sample."""
    import pandas as pd

    text = path.read_text("utf-8-sig", "replace")
    try:
        try:
            whole = json.loads(text)
        except ValueError:
            whole = [json.loads(line) for line in text.splitlines() if line.strip()]
        if isinstance(whole, list) and not all(isinstance(one, dict) for one in whole):
            whole = (
                {f"data[{i}]": one for i, one in enumerate(whole, 1)} if isinstance(whole[0], list) else {"data": whole}
            )
        frame = pd.json_normalize(whole)
        for name in [
            name for name in frame if isinstance(value := frame[name].iloc[0], list) and isinstance(value[0], dict)
        ]:
            inner = pd.json_normalize(frame[name].iloc[0])  # a list of records
            frame = frame.drop(columns=name).join(pd.DataFrame({f"{name}.{key}": [list(inner[key])] for key in inner}))
        return _of_frame(path, frame)
    except Exception as error:  # such as a document of settings
        raise NoRecordingError(f"{path}: a JSON text that cannot be read as samples ({first_line(error)}).") from None


def _of_frame(path: Path, frame: Any) -> RawFile:
    """Convert a pandas table; a row contains single samples, or lists of samples and the time of the first sample."""
    variables: dict[str, ArrayOrText] = {}
    attributes: dict[str, float | str] = {}
    units: dict[str, str] = {}
    lists = [name for name in frame if len(frame) and isinstance(frame[name].iloc[0], list | np.ndarray)]
    counts = frame[lists[0]].map(len).to_numpy() if lists else np.ones(len(frame), int)
    for name, column in frame.items():
        values = column.to_numpy()
        first, times = values[0] if values.size else None, None
        if name in lists:
            flat = np.concatenate([np.asarray(value) for value in values])
            times = parse_time_stamps(flat.tolist()) if flat.dtype.kind in "UO" and is_time(name) else None
            values = flat.astype(np.float64) if times is None else times
        elif column.dtype.kind in "mM":
            times = (column - column.iloc[0]).dt.total_seconds().to_numpy()
        elif is_time(name) and not isinstance(first, int | float | np.number):
            times = parse_time_stamps([str(value) for value in values])
        elif isinstance(first, str):
            attributes |= {"unit" if is_unit_key(name) else name: first} if column.nunique() == 1 else {}
            continue
        else:
            values = column.astype(np.float64).to_numpy() if column.dtype.kind not in "fiu" else values
        units |= {name: "s"} if times is not None else {}
        values = values if times is None else times
        if name not in lists and (lists or values.size == 1):
            if is_time(name) and values.size > 1:
                step = float(np.median(np.diff(values) / counts[:-1]))
                values = np.concatenate([at + step * np.arange(n) for at, n in zip(values, counts, strict=True)])
            elif values.size == 1 or np.ptp(values) == 0:
                attributes[name] = float(values[0])
                continue
        variables[name] = values
    return RawFile(path=path, variables=variables, attributes=attributes, units=units)
