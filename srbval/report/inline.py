"""The report's inline markup: ``**strong**`` and ```code```, everything else is text.

A backslash before ``*``, a backtick or a backslash makes it text. Text that comes from a file or a
recording goes through `literal` first, so that it can never turn into markup.
"""

import re

Span = tuple[str, str]  # (kind, text), kind one of "text", "strong", "code"

_TOKEN = re.compile(r"\\(?P<escaped>[*`\\])|\*\*(?P<strong>[^*]+)\*\*|`(?P<code>[^`]+)`", re.DOTALL)
# C0 and C1 controls but tab and newline, lone surrogates, direction overrides, non-characters.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")

# Where a line must not end: between a number and its unit, and on both sides of a plus-minus sign.
_WITHIN_QUANTITY = re.compile(
    r"(?<=\d) (?=(?:%|°|dB|rpm|[kM]?Hz|k?N|[mµn]?m|[mµn]?s|m/s²?|h|min)(?![\w/]))| (?=±)|(?<=±) "
)


def literal(text: str) -> str:
    """Escape `text` so that `spans` gives it back unchanged, as one piece of plain text."""
    return re.sub(r"([*`\\])", r"\\\1", text)


def printable(text: str) -> str:
    """Replace what no page can show (controls, lone surrogates, direction overrides) by U+FFFD."""
    return _UNPRINTABLE.sub("\ufffd", text)


def spans(text: str) -> tuple[Span, ...]:
    """Split `text` into runs of (kind, text); a marker without its partner is text.

    Quantities are held together: the blank between a number and its unit is one that no line ends at.
    """
    found: list[Span] = []
    position = 0
    for match in _TOKEN.finditer(text):
        _append(found, "text", text[position : match.start()])
        kind = match.lastgroup or "text"
        _append(found, "text" if kind == "escaped" else kind, match[kind])
        position = match.end()
    _append(found, "text", text[position:])
    return tuple(found)


def _append(found: list[Span], kind: str, text: str) -> None:
    text = printable(text) if kind == "code" else _WITHIN_QUANTITY.sub("\u00a0", printable(text))
    if text and kind == "text" and found and found[-1][0] == "text":
        found[-1] = ("text", found[-1][1] + text)
    elif text:
        found.append((kind, text))
