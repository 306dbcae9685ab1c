"""Files of named arrays: NumPy (pickled objects are never opened), Parquet and Feather."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import FileFormat, begins
from srbval.recordings.raw import LONGEST_NAME, RawFile, Value, check_claim, first_line

TABLE_EXPANSION = 16  # both are compressed, values that repeat are stored once
MAX_COLUMNS = 256
PARQUET, FEATHER = b"PAR1", b"ARROW1\0\0"
UNIT_KEYS = (b"unit", b"units")  # in the metadata of a column


def load_npy(path: Path) -> RawFile:
    """Read the one array of a .npy file, mapped from disk, into ``data``; its header must agree with its size."""
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # the one border where a hostile file meets foreign code
        raise DataError(f"{path}: truncated or unusable .npy file ({first_line(error)}). Save plain numbers.") from None
    if values.dtype.kind not in "fiu":
        raise DataError(f"{path}: holds {values.dtype} values; real numbers are needed.")
    if values.nbytes != (held := path.stat().st_size - values.offset):
        size = " x ".join(map(str, values.shape))[:LONGEST_NAME]
        claimed = f"{size} values ({values.dtype}) in {held} bytes"
        raise DataError(f"{path}: truncated or damaged: its header claims {claimed}. Copy it again.")
    return RawFile(path=path, format=NPY.name, variables={"data": values})


def load_npz(path: Path) -> RawFile:
    """Read every array of an .npz archive under its own name; texts of one element stay texts, objects are left out."""
    with zipfile.ZipFile(path) as archive:
        check_claim(path, sum(member.file_size for member in archive.infolist()), "its contents")
        names = [member.removesuffix(".npy") for member in archive.namelist() if member.endswith(".npy")]
    if not names:
        raise DataError(f"{path}: a ZIP archive without NumPy arrays. Export a workbook as CSV, unpack an archive.")
    variables: dict[str, Value] = {}
    left = []
    with np.load(path, allow_pickle=False) as arrays:
        for name in names:
            try:
                array = arrays[name]
                variables[name] = str(array.flat[0]) if array.dtype.kind == "U" and array.size == 1 else array
            except ValueError as error:  # objects, which only unpickling would bring
                if "allow_pickle" not in str(error):
                    raise
                left.append(name)
    notes = (f"left out, no plain numbers: {', '.join(left)[:LONGEST_NAME]}",) if left else ()
    return RawFile(path=path, format=NPZ.name, variables=variables, notes=notes)


def load_table(path: Path) -> RawFile:
    """Read the numeric columns and the times of a table; calendar times become seconds from the first one."""
    import pyarrow
    from pyarrow import parquet, types

    def numeric(schema: Any) -> list[str]:
        fits = (types.is_integer, types.is_floating, types.is_timestamp)
        names = [field.name for field in schema if any(fit(field.type) for fit in fits)]
        if len(names) > MAX_COLUMNS or len(set(names)) < len(names):
            most = f"{MAX_COLUMNS} are read at most, each with a name of its own"
            raise DataError(f"{path}: {len(names)} columns; {most}.")
        return names

    with path.open("rb") as stream:
        is_parquet = stream.read(len(PARQUET)) == PARQUET
    if is_parquet:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            wanted = numeric(file.schema_arrow)
            check_claim(path, 8 * file.metadata.num_rows * len(wanted), "its table", TABLE_EXPANSION)
            table = file.read(columns=wanted, use_threads=False)
    else:
        options = pyarrow.ipc.IpcReadOptions(use_threads=False)
        with pyarrow.OSFile(str(path)) as source, pyarrow.ipc.open_file(source, options=options) as file:
            table = file.read_all()
            table = table.select(numeric(table.schema))
    table.validate(full=True)
    variables = {name: np.asarray(table.column(name).to_numpy()) for name in table.column_names}
    units = {f.name: (f.metadata or {})[k].decode() for f in table.schema for k in UNIT_KEYS if k in (f.metadata or {})}
    for name, values in variables.items():
        if values.dtype.kind == "M":
            variables[name] = (values - values[:1]) / np.timedelta64(1, "s")
            units[name] = "s"
    return RawFile(
        path=path,
        format="Parquet" if is_parquet else "Feather",
        variables=variables,
        attributes={k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()},
        units=units,
    )


_PYARROW = ("pyarrow.parquet", "pyarrow")
NPY = FileFormat("NumPy", "NumPy .npy", begins(b"\x93NUMPY"), load_npy, trusted=True)
NPZ = FileFormat("NumPy archive", "NumPy .npz", begins(b"PK\x03\x04"), load_npz, ".npz file")
_TABLE = begins(PARQUET, FEATHER)
TABLE = FileFormat("table in columns", "Parquet, Feather", _TABLE, load_table, "table", _PYARROW, TABLE_EXPANSION)
