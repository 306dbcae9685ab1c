"""How much memory a file may ask for: a few bytes can claim terabytes."""

from __future__ import annotations

from pathlib import Path

from srbval.errors import DataError

EXPANSION = 2  # times the file's own size: measured noise hardly compresses
FREE_BYTES = 256 * 2**20  # small files may expand to this much in any case


def check_claim(path: Path, claimed_bytes: int, what: str) -> None:
    """Refuse (`DataError`) an array whose claimed size is out of proportion to the file."""
    size = path.stat().st_size
    limit = EXPANSION * size + FREE_BYTES
    if claimed_bytes > limit:
        raise DataError(
            f"{path}: {what} claims {claimed_bytes} bytes in a file of {size}; the limit is {limit}. "
            "The file is damaged or not a recording."
        )
