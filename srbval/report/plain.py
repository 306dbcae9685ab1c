"""The report as nested dicts of finished text: what both page renderers are given.

Every number is formatted here and only here, so the HTML page and the PDF cannot differ.
"""

from typing import Any

from srbval.report import blocks
from srbval.report.blocks import Cell, Column, Figure, FigureGrid, Table, format_value
from srbval.report.inline import printable, spans
from srbval.report.model import Document, Report
from srbval.storage.json_files import json_text

Plain = dict[str, Any]


def as_plain(report: Report, document: Document = Document.MAIN, *, with_appendix: bool = False) -> Plain:
    """Turn one document of a report into dicts, lists and strings; inline markup becomes lists of (kind, text).

    `other` names the file of the other document where it is made too (`with_appendix`), for links to it.
    """
    is_main = document is Document.MAIN
    verdict, other = report.verdict, Document.APPENDIX if is_main else Document.MAIN
    return {
        "document": document.value,
        "other": other.value if with_appendix else None,
        "has_appendix": report.has_appendix,
        "title": printable(report.title),
        "subtitle": printable(report.subtitle),
        "generated": report.generated_text,
        "language": report.language,
        "verdict": {
            "tone": verdict.tone.value,
            "sign": verdict.tone.sign,
            "headline": spans(verdict.headline),
            "points": [spans(point) for point in verdict.points],
        }
        if is_main
        else None,
        "sections": [
            {
                "id": s.id,
                "title": printable(s.title),
                "blocks": [_plain_block(b) for b in s.part(document)],
                "elsewhere": _counted(s.part(other)),
            }
            for s in report.sections
            if s.part(document)
        ],
    }


def _counted(elsewhere: tuple[blocks.Block, ...]) -> str | None:
    """How many tables and figures a section has in the other document, in words; None where it has nothing there."""
    if not elsewhere:
        return None
    tables = sum(isinstance(block, Table) for block in elsewhere)
    figures = sum(len(block.figures) if isinstance(block, FigureGrid) else isinstance(block, Figure)
                  for block in elsewhere)  # fmt: skip
    return ", ".join(f"{n} {what}{'s' * (n > 1)}" for n, what in ((tables, "table"), (figures, "figure")) if n)


def _plain_block(block: blocks.Block) -> Plain:
    """One block as a dict with its `kind`."""
    match block:
        case blocks.Paragraph():
            return {"kind": "paragraph", "text": spans(block.text)}
        case blocks.Listing():
            return {"kind": "listing", "numbered": block.numbered, "items": [spans(item) for item in block.items]}
        case blocks.Callout():
            return {"kind": "callout", "tone": block.tone.value, "sign": block.tone.sign,
                    "title": printable(block.title), "text": spans(block.text)}  # fmt: skip
        case blocks.Command():
            return {"kind": "command", "text": printable(block.text)}
        case blocks.KeyValues():
            pairs = [(printable(str(key)), printable(format_value(value, ""))) for key, value in block.pairs.items()]
            return {"kind": "key-values", "pairs": pairs}
        case Figure():
            return _plain_figure(block)
        case FigureGrid():
            return {"kind": "grid", "columns": block.columns, "label": printable(block.label),
                    "caption": spans(block.caption), "figures": [_plain_figure(f) for f in block.figures]}  # fmt: skip
        case Table():
            return _plain_table(block)


def _plain_figure(block: Figure) -> Plain:
    return {
        "kind": "figure",
        "id": block.id,
        "label": printable(block.label),
        "caption": spans(block.caption),
        "alt": printable(block.alt),
        "picture": block.picture_name,
        "data": block.data_name,
        "synthetic": block.synthetic,
        "badge": block.badge.value if block.badge else None,
        "wide": block.wide,
        "explore": None if block.explore is None else json_text(block.explore),
    }


def _plain_table(block: Table) -> Plain:
    return {
        "kind": "table",
        "id": block.id,
        "label": printable(block.label),
        "caption": spans(block.caption),
        "row_headers": block.row_headers,
        "columns": [
            {"title": printable(c.title), "unit": printable(c.unit), "align": c.alignment} for c in block.columns
        ],
        "rows": [[_plain_cell(v, c) for v, c in zip(row, block.columns, strict=True)] for row in block.cells],
        "notes": [spans(note) for note in block.notes],
    }


def _plain_cell(cell: Cell, column: Column) -> Plain:
    return {
        "text": printable(cell.text(column)),
        "number": not isinstance(cell.value, str),
        "align": column.alignment,
        "badge": cell.badge.value if cell.badge else None,
        "tone": cell.tone.value if cell.tone else None,
        "sign": cell.tone.sign if cell.tone else "",
        "note": printable(cell.note),
    }
