"""NumPy .npy files; pickled objects are never opened."""

from pathlib import Path

import numpy as np

from srbval.errors import DataError
from srbval.recordings.raw import FileFormat, RawFile, first_line

SIGNATURE = b"\x93NUMPY"


def load_npy(path: Path) -> RawFile:
    """Read the one array of a .npy file, mapped from disk; its variable is called ``data``."""
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # the one border where a hostile file meets foreign code
        raise DataError(f"{path}: truncated or unusable .npy file ({first_line(error)}). Save plain numbers.") from None
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu":
        kind = getattr(values, "dtype", type(values).__name__)
        raise DataError(f"{path}: holds {kind} values; real numbers are needed.")
    return RawFile(path=path, format=FORMAT.name, variables={"data": values})


FORMAT = FileFormat(
    name="NumPy",
    description="NumPy .npy",
    matches=lambda head: head.startswith(SIGNATURE),
    load=load_npy,
)
