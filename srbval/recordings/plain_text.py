"""Names and labels out of files, made fit to be shown: they may hold anything."""

from __future__ import annotations

LONGEST_NAME = 80


def plain_text(text: str, longest: int = LONGEST_NAME) -> str:
    """`text` on one line, without control characters, cut after `longest` characters.

    Markup is left as it is: whoever writes HTML or a terminal's colours escapes it there.
    """
    shown = "".join(c if c.isprintable() else "?" for c in text[: longest + 1])
    return shown if len(shown) <= longest else shown[: longest - 1] + "…"
