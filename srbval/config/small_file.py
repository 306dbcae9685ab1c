"""Reading a small file that someone named: it may be a pipe, a device, a folder, or far too large."""

import stat
from pathlib import Path

from srbval.errors import DataError

MOST_BYTES = 2**21  # a speed profile of 100,000 entries fits; reading more than that as TOML would take seconds


def read_small_file(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """The content of a regular file of at most `most_bytes`; `DataError` for everything else."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise DataError(f"{path}: not a regular file. Check the path.")
        with path.open("rb") as file:
            content = file.read(most_bytes + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise DataError(f"{path}: no such file. Check the path.") from None
    except (OSError, ValueError) as error:  # a path with a NUL or a lone surrogate is a ValueError
        raise DataError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from None
    if len(content) > most_bytes:
        raise DataError(f"{path}: more than {most_bytes} bytes, which is the limit for a file of this kind.")
    return content
