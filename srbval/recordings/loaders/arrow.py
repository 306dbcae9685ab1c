"""Tables in columns, Parquet and Feather (an Arrow file), by the library pyarrow."""

from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import Library, limited_format
from srbval.recordings.raw import RawFile, Value, check_claim

EXPANSION = 16  # both are compressed, values that repeat are stored once
MAX_COLUMNS = 256
PARQUET, ARROW = b"PAR1", b"ARROW1\0\0"
UNIT_KEYS = (b"unit", b"units")  # in the metadata of a column


def load_arrow(path: Path) -> RawFile:
    """Read the numeric columns and the times of a table; metadata of the table are attributes, of columns units.

    Times of the calendar become seconds from the first one. A value that is missing becomes NaN, which is refused
    where it is used.
    """
    import pyarrow
    from pyarrow import parquet

    with path.open("rb") as stream:
        is_parquet = stream.read(len(PARQUET)) == PARQUET
    if is_parquet:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            wanted = _numeric(path, file.schema_arrow)
            check_claim(path, 8 * file.metadata.num_rows * len(wanted), "its table", EXPANSION)
            table = file.read(columns=wanted, use_threads=False)
    else:
        options = pyarrow.ipc.IpcReadOptions(use_threads=False)
        with pyarrow.OSFile(str(path)) as source, pyarrow.ipc.open_file(source, options=options) as file:
            table = file.read_all()
            table = table.select(_numeric(path, table.schema))
    table.validate(full=True)
    variables = {name: _column(table.column(name)) for name in table.column_names}
    stamps = [f.name for f in table.schema if pyarrow.types.is_timestamp(f.type)]
    metadata = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
    units = {f.name: (f.metadata or {})[k].decode() for f in table.schema for k in UNIT_KEYS if k in (f.metadata or {})}
    return RawFile(
        path=path,
        format="Parquet" if is_parquet else "Feather",
        variables=variables,
        attributes=metadata,
        units=units | dict.fromkeys(stamps, "s"),
    )


def _numeric(path: Path, schema: Any) -> list[str]:
    """Names of the columns of numbers and times; no two are the same."""
    from pyarrow import types

    fits = (types.is_integer, types.is_floating, types.is_timestamp)
    names = [field.name for field in schema if any(fit(field.type) for fit in fits)]
    if len(names) > MAX_COLUMNS or len(set(names)) < len(names):
        raise DataError(f"{path}: {len(names)} columns; {MAX_COLUMNS} are read at most, each with a name of its own.")
    return names


def _column(column: Any) -> Value:
    values = column.to_numpy()
    if values.dtype.kind != "M":
        return np.asarray(values)
    return (values - values[0]) / np.timedelta64(1, "s") if values.size else np.zeros(0)


FORMAT = limited_format(
    name="table in columns",
    description="Parquet, Feather",
    matches=lambda head: head.startswith((PARQUET, ARROW)),
    load=load_arrow,
    kind="table",
    library=Library("pyarrow.parquet", "pyarrow", "srbval[tables]"),
    expansion=EXPANSION,
)
