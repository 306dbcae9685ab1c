"""Identifiers of sections, tables and figures: they become anchors and file names, so they are strict."""

import re

_IDENTIFIER = re.compile(r"[a-z][a-z0-9-]{0,63}")


def check_identifier(identifier: str, what: str) -> None:
    """Raise ValueError unless `identifier` is lower-case letters, digits and hyphens, a letter first."""
    if not _IDENTIFIER.fullmatch(identifier):
        raise ValueError(
            f"{what} id {identifier[:80]!r}: use at most 64 lower-case letters, digits and hyphens, a letter first."
        )
