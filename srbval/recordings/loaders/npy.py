"""NumPy files, one array (.npy) or an archive of some (.npz); pickled objects are never opened."""

import math
import zipfile
from pathlib import Path

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import limited_format
from srbval.recordings.raw import LONGEST_NAME, FileFormat, RawFile, Value, check_claim, first_line

SIGNATURE, ZIP = b"\x93NUMPY", b"PK\x03\x04"
# Version 3 differs in the names of fields, and arrays with fields are not recordings.
READ_HEADER = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def load_npy(path: Path) -> RawFile:
    """Read the one array of a .npy file, mapped from disk; its variable is called ``data``.

    Header and size of the file must agree: a damaged header would otherwise cut samples off, or claim more than memory.
    """
    try:
        with path.open("rb") as stream:
            version = np.lib.format.read_magic(stream)
            if version not in READ_HEADER:
                raise DataError(f"{path}: version {version} of its format holds fields. Save plain numbers.")
            shape, fortran, kind = READ_HEADER[version](stream)
            start, end = stream.tell(), stream.seek(0, 2)
        if kind.kind not in "fiu":
            raise DataError(f"{path}: holds {kind} values; real numbers are needed.")
        if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize != end - start:
            size = " x ".join(map(str, shape))[:LONGEST_NAME]
            held = f"{size} values ({kind}) in {end - start} bytes"
            raise DataError(f"{path}: truncated or damaged: its header claims {held}. Copy it again.")
        values = np.memmap(path, kind, "r", start, shape, "F" if fortran else "C")
    except DataError:
        raise
    except Exception as error:  # the one border where a hostile file meets foreign code
        raise DataError(f"{path}: truncated or unusable .npy file ({first_line(error)}). Save plain numbers.") from None
    return RawFile(path=path, format=FORMAT.name, variables={"data": values})


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
    return RawFile(path=path, format=ARCHIVE.name, variables=variables, notes=notes)


FORMAT = FileFormat(
    name="NumPy",
    description="NumPy .npy",
    matches=lambda head: head.startswith(SIGNATURE),
    load=load_npy,
)
ARCHIVE = limited_format(
    name="NumPy archive",
    description="NumPy .npz",
    matches=lambda head: head.startswith(ZIP),
    load=load_npz,
    kind=".npz file",
)
