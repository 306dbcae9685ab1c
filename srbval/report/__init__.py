"""The report: a tree of sections, tables and figures, and one thin renderer for each format."""

from srbval.report.blocks import (
    Badge,
    Block,
    Callout,
    Cell,
    Column,
    Command,
    Explore,
    Figure,
    FigureGrid,
    KeyValues,
    Listing,
    Paragraph,
    Table,
    Tone,
)
from srbval.report.inline import literal
from srbval.report.model import Report, Section, VerdictBox
from srbval.report.write import FORMATS, write_report

__all__ = [
    "FORMATS",
    "Badge",
    "Block",
    "Callout",
    "Cell",
    "Column",
    "Command",
    "Explore",
    "Figure",
    "FigureGrid",
    "KeyValues",
    "Listing",
    "Paragraph",
    "Report",
    "Section",
    "Table",
    "Tone",
    "VerdictBox",
    "literal",
    "write_report",
]
