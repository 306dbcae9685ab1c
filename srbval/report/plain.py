"""Convert a report, and the markup in its texts, to nested dicts of formatted text for the HTML and PDF renderers.

Numbers are formatted only here, so that the HTML page and the PDF cannot differ. The markup is ``**strong**`` and
```code```; a backslash before ``*``, a backtick or a backslash makes it text. Text from a file or a recording goes
through `literal` first, so that it cannot become markup.
"""

import dataclasses
import enum
import itertools
import re
from datetime import UTC
from operator import itemgetter
from typing import Any

from srbval import __version__
from srbval.report.blocks import Cell, KeyValues, Report, ReportTable, TableColumn, format_value

Span = tuple[str, str]  # (kind, text), kind one of "text", "strong", "code"
MAX_OPEN_SECTIONS = 3  # sections of a page without folds; a page with more sections folds them
UNSHOWN = {"draw", "value", "ci95"}  # fields that the renderers do not read: the text of a cell contains its numbers
MARKUP = {"caption", "headline", "items", "kicker", "notes", "points", "text"}  # fields with inline markup

_TOKEN = re.compile(r"\\(?P<escaped>[*`\\])|\*\*(?P<strong>[^*]+)\*\*|`(?P<code>[^`]+)`", re.DOTALL)
# C0 and C1 controls but tab and newline, lone surrogates, direction overrides, non-characters.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")

# Where a line must not end: between a number and its unit, and on both sides of a plus-minus sign.
_WITHIN_QUANTITY = re.compile(
    r"(?<=\d) (?=(?:%|°|dB|rpm|[kM]?Hz|k?N|[mµn]?m|[mµn]?s|m/s²?|h|min)(?![\w/]))| (?=±)|(?<=±) "
)


def literal(text: str) -> str:
    """Escape the markup characters of a text, so that it is printed unchanged."""
    return re.sub(r"([*`\\])", r"\\\1", text)


def mask_controls(text: str) -> str:
    """Replace characters that no page can print (controls, lone surrogates, direction overrides) by U+FFFD."""
    return _UNPRINTABLE.sub("\ufffd", text)


def spans(text: str) -> tuple[Span, ...]:
    """Split a text with markup into (kind, text) pieces; join a number and its unit by a no-break space."""
    pieces, position = list[Span](), 0
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup or "text"
        pieces += [("text", text[position : match.start()]), ("text" if kind == "escaped" else kind, match[kind])]
        position = match.end()
    found = list[Span]()
    for kind, neighbours in itertools.groupby([*pieces, ("text", text[position:])], key=itemgetter(0)):
        if part := mask_controls("".join(piece for _, piece in neighbours)):
            found.append((kind, part if kind == "code" else _WITHIN_QUANTITY.sub("\u00a0", part)))
    return tuple(found)


def as_plain(report: Report) -> dict[str, Any]:
    """Convert a report to dicts, lists and strings; text with markup becomes a list of (kind, text) pieces."""
    return {
        "title": mask_controls(report.title),
        "subtitle": mask_controls(report.subtitle),
        "made_by": f"srbval {__version__}",
        "generated": report.generated_utc.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S UTC"),
        "verdict": _plain(report.verdict),
        "sections": [
            _plain(section) | {"open": section.open or len(report.sections) <= MAX_OPEN_SECTIONS}
            for section in report.sections
            if section.blocks
        ],
    }


def _plain(value: Any, name: str = "") -> Any:
    """Convert a value in the report's field `name` to text, list or dict; a dict's `kind` is its dataclass's name."""
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, str):
        return spans(value) if name in MARKUP else mask_controls(value)
    if isinstance(value, list | tuple):
        return [_plain(item, name) for item in value]
    if isinstance(value, dict):
        return {key: mask_controls(item) if isinstance(item, str) else item for key, item in value.items()}
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        return value
    names = (*(field.name for field in dataclasses.fields(value)), *getattr(value, "JSON_PROPERTIES", ()))
    parts = {name: getattr(value, name) for name in names if name not in UNSHOWN}
    if isinstance(value, KeyValues):
        parts["pairs"] = [(str(key), format_value(item, "")) for key, item in value.pairs.items()]
    if isinstance(value, ReportTable):
        parts["rows"] = [[_cell(*pair) for pair in zip(row, value.columns, strict=True)] for row in value.rows]
    found = {"kind": type(value).__name__} | {key: _plain(item, key) for key, item in parts.items()}
    if parts.get("tone"):
        found["sign"] = parts["tone"].sign
    return found


def _cell(cell: Cell, column: TableColumn) -> dict[str, Any]:
    return _plain(cell) | {"text": cell.text(column), "number": not isinstance(cell.value, str)}
