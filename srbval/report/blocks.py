"""Parts of a report as frozen dataclasses: the report, its sections, and blocks such as tables and figures."""

import enum
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from srbval.report.figures.style import Drawing

FIGURES_FOLDER = "figures"  # the folder of pictures and their data beside the documents
CellValue = float | int | str | bool | None
REPORT_SCHEMA = 1  # version of the keys of report.json
MISSING = "–"
ReportRow = Mapping[str, Any]  # a row of a list in report.json, by its keys
OF_VALUE = ("", "_ci95", "_badge", "_tone", "_note")  # ends of the keys of a value in a table's row, see `ReportTable`


class Tone(enum.StrEnum):
    """Judgement of a value, a verdict or a boxed remark: good, bad, warning or neutral."""

    GOOD = "good"
    BAD = "bad"
    WARNING = "warning"
    NEUTRAL = "neutral"

    @property
    def sign(self) -> str:
        """Character printed before a text so that its tone can be recognised without colour."""
        return {"good": "✓", "bad": "✗", "warning": "⚠", "neutral": "•"}[self.value]


@dataclass(frozen=True)
class TableColumn:
    """Column of a table; a `format`, such as ``.2f``, formats the numbers of the column and aligns them right."""

    title: str
    unit: str = ""
    format: str = ""


def cell_text(value: CellValue, ci95: float | None, spec: str) -> str:
    """Format a value and its 95 % half width `ci95`; decimals beyond the second significant digit of it are omitted."""
    fixed = re.fullmatch(r"([+,]*)\.(\d+)f", spec)
    if fixed and ci95 and math.isfinite(ci95):
        spec = f"{fixed[1]}.{min(int(fixed[2]), max(0, 1 - math.floor(math.log10(ci95))))}f"
    shown = format_value(value, spec)
    return shown if ci95 is None or shown == MISSING else f"{shown} ± {format_value(ci95, spec.lstrip('+'))}"


def format_value(value: CellValue, spec: str) -> str:
    """Format a number by `spec`, a truth value as yes or no, a missing value as a dash; text is unchanged."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    shown = format(int(value) if spec.endswith("d") and value == int(value) else value, spec)
    reads_as_zero = "0" in shown and not any(digit in shown for digit in "123456789")
    return shown.lstrip("+-") if reads_as_zero else shown


@dataclass(frozen=True, kw_only=True)
class ReportTable:
    """Table with a caption; the first cell of each row is the header of the row.

    A row contains the values by the keys of `columns`. The keys ``X_ci95``, ``X_badge``, ``X_tone`` and ``X_note``, if
    present, give the 95 % half width, the source (measured, published, simulated, stand-in), the judgement (`Tone`) and
    the remark of the value ``X``. `label` ("Table 6") precedes the caption, `notes` follow the table.
    """

    JSON_OMITTED: ClassVar = ("notes",)

    id: str
    caption: str
    columns: Mapping[str, TableColumn]
    rows: tuple[Mapping[str, Any], ...]
    label: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Paragraph:
    """Paragraph of text with inline markup (see `srbval.report.renderers`)."""

    text: str


@dataclass(frozen=True)
class Heading:
    """Title of a part of a section, as plain text."""

    title: str


@dataclass(frozen=True)
class Listing:
    """List of short texts with inline markup."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Callout:
    """Remark in a box; the tone sets the colour and the sign of the box."""

    tone: Tone
    text: str
    title: str = ""


@dataclass(frozen=True)
class Command:
    """Command line, or content of a file, printed unchanged in a box."""

    line: str


@dataclass(frozen=True, kw_only=True)
class Figure:
    """Picture with its data, caption and alternative text.

    ``draw(folder, id)`` writes the picture (SVG) and the plotted data (CSV). `label` ("Figure 11a") precedes the
    caption. A `wide` figure takes the full width of the text. `small_of` is empty, or for a thumbnail the id of the
    full figure. `explore` describes an interactive chart of the data as JSON (see `explore_spectrum`).
    """

    JSON_OMITTED: ClassVar = ("draw", "wide", "small_of", "explore")
    JSON_PROPERTIES: ClassVar = ("file", "data")

    id: str
    caption: str
    alt: str
    draw: Drawing
    label: str = ""
    badge: str | None = None
    wide: bool = True
    small_of: str = ""
    explore: str = ""

    @property
    def file(self) -> str:
        """Path of the picture relative to the report's folder."""
        return f"{FIGURES_FOLDER}/{self.id}.svg"

    @property
    def data(self) -> str:
        """Path of the plotted data (CSV) relative to the report's folder."""
        return f"{FIGURES_FOLDER}/{self.id}.csv"


@dataclass(frozen=True, kw_only=True)
class FigureGrid:
    """Figures side by side in 1 to 4 `columns`, with one common caption."""

    figures: tuple[Figure, ...]
    columns: int = 2
    caption: str = ""
    label: str = ""


Block = Heading | Paragraph | Listing | Callout | Command | ReportTable | Figure | FigureGrid


@dataclass(frozen=True, kw_only=True)
class VerdictBox:
    """Main result at the top of the page: headline, short line above it (`kicker`), list of `points`, figure.

    `blocks` follow below the headline; if there are any, the HTML page omits `points` and `figure`.
    """

    tone: Tone
    headline: str
    kicker: str = "Verdict"
    points: tuple[str, ...] = ()
    figure: Figure | None = None
    blocks: tuple[Block, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Section:
    """Section of a report; `id` is its anchor. On a page with many sections, only sections with `open` are expanded."""

    id: str
    title: str
    blocks: tuple[Block, ...] = ()
    open: bool = False


@dataclass(frozen=True, kw_only=True)
class Report:
    """Complete report; `data` is the content of ``report.json`` except for its tables and figures."""

    title: str
    verdict: VerdictBox
    sections: tuple[Section, ...]
    subtitle: str = ""
    data: dict[str, Any] = field(default_factory=dict)

    def _blocks(self) -> Iterator[Block | None]:
        """Iterate over all blocks in the order of the page, and over the figures of each grid."""
        of_sections = (block for section in self.sections for block in section.blocks)
        for block in (self.verdict.figure, *self.verdict.blocks, *of_sections):
            yield from block.figures if isinstance(block, FigureGrid) else (block,)

    def figures(self) -> list[Figure]:
        """Return all figures in the order of the page."""
        return [block for block in self._blocks() if isinstance(block, Figure)]

    def tables(self) -> list[ReportTable]:
        """Return all tables in the order of the page."""
        return [block for block in self._blocks() if isinstance(block, ReportTable)]
