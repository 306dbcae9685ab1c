"""NumPy .npy files; pickled objects are never opened."""

import math
from pathlib import Path

import numpy as np

from srbval.errors import DataError
from srbval.recordings.raw import LONGEST_NAME, FileFormat, RawFile, first_line

SIGNATURE = b"\x93NUMPY"
# Version 3 differs in the names of fields, and arrays with fields are no recordings.
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


FORMAT = FileFormat(
    name="NumPy",
    description="NumPy .npy",
    matches=lambda head: head.startswith(SIGNATURE),
    load=load_npy,
)
