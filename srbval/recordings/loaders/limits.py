"""How much memory a file may ask for: a few bytes can claim terabytes."""

from __future__ import annotations

from pathlib import Path

from srbval.errors import DataError

EXPANSION = 2  # times the file's own size: measured noise hardly compresses
FREE_BYTES = 128 * 2**20  # small files may expand to this much in any case


def largest_claim(path: Path) -> int:
    """The most the contents of this file may take when read [bytes]."""
    return EXPANSION * path.stat().st_size + FREE_BYTES


def check_claim(path: Path, claimed_bytes: int, what: str) -> None:
    """Refuse (`DataError`) an array whose claimed size is out of proportion to the file."""
    limit = largest_claim(path)
    if claimed_bytes > limit:
        raise DataError(
            f"{path}: {what} claims {claimed_bytes} bytes in a file of {path.stat().st_size}; the limit is "
            f"{limit}. The file is damaged or not a recording."
        )
