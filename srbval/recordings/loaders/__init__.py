"""File formats, recognised by the first bytes of a file; a new format needs an entry in `FILE_FORMATS`."""

import re
from pathlib import Path

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.loaders import arrays, hdf5, matlab, signals, text
from srbval.recordings.loaders.limited import FileFormat

HEAD_BYTES = 4096

# The first format whose mark matches is used.
FILE_FORMATS: tuple[FileFormat, ...] = (
    arrays.NPY,
    arrays.NPZ,
    hdf5.HDF5_FORMAT,
    matlab.MATLAB,
    matlab.MODELICA,
    signals.AUDIO,
    signals.TDMS,
    signals.UFF,
    signals.LVM,
    arrays.COLUMN_TABLE,
    arrays.JSON,
    text.TEXT_TABLE,
)


def detect_format(path: Path) -> FileFormat:
    """Format of a file; `DataError` if it is missing, empty or of no known format, `OSError` if it cannot be read."""
    try:
        if path.is_dir():
            raise DataError(f"{path}: is a folder, not a recording; `srbval data add {path}` registers it.")
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: is not a regular file.")
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except FileNotFoundError:
        raise DataError(f"{path}: no such file. Check the path.") from None
    except ValueError as error:
        raise DataError(f"{str(path)!r}: not a usable path ({error}).") from None
    if not head:
        raise DataError(f"{path}: the file is empty (0 bytes). Copy or download it again.")
    for candidate in FILE_FORMATS:
        if re.match(candidate.mark, head, re.DOTALL):
            return candidate
    accepted = ", ".join(candidate.description for candidate in FILE_FORMATS)
    raise NoRecordingError(
        f"{path}: starts with {head[:8]!r}, which is not a known recording format. Accepted: {accepted}."
    )
