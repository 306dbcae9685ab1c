"""The report as a tree of frozen dataclasses; a source (`Badge`) and a judgement (`Tone`) are words before colours."""

import enum
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from srbval.report.figures.style import Drawing

FIGURES_FOLDER = "figures"  # the folder of pictures and their data beside the documents
CellValue = float | int | str | bool | None
MISSING = "–"
REQUIRED_TEXTS = {"alt": "an alt text: describe the picture", "caption": "a caption"}
ReportRow = Mapping[str, Any]  # a row of a list in report.json, by its keys
_IDENTIFIER = re.compile(r"[a-z][a-z0-9-]{0,63}")


class Badge(enum.StrEnum):
    """Source of a value or a picture."""

    MEASURED = "measured"
    PUBLISHED = "published"
    STAND_IN = "stand-in"
    SIMULATED = "simulated"
    COMPUTED = "computed"


class Tone(enum.StrEnum):
    """Judgement of a value, a verdict or a callout; `sign` is shown beside its text."""

    GOOD = "good"
    BAD = "bad"
    WARNING = "warning"
    NEUTRAL = "neutral"

    @property
    def sign(self) -> str:
        """One character that tells the tones apart without colour."""
        return {"good": "✓", "bad": "✗", "warning": "⚠", "neutral": "•"}[self.value]


@dataclass(frozen=True, kw_only=True)
class TableColumn:
    """One column; a `format`, a Python format specification for numbers such as ``.2f``, aligns it right."""

    title: str
    unit: str = ""
    format: str = ""

    @property
    def align(self) -> str:
        """Alignment of the column."""
        return "right" if self.format else "left"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One value, plain text: its half width of a 95 % interval, its source, its judgement and a short remark below it.

    None and non-finite values show as a dash, an interval with at most two digits.
    """

    value: CellValue
    ci95: float | None = None
    badge: Badge | None = None
    tone: Tone | None = None
    note: str = ""

    def text(self, column: TableColumn) -> str:
        """Text of the value, the same in every renderer."""
        spec, ci95 = column.format, self.ci95
        fixed = re.fullmatch(r"([+,]*)\.(\d+)f", spec)
        if fixed and ci95 and math.isfinite(ci95):
            spec = f"{fixed[1]}.{min(int(fixed[2]), max(0, 1 - math.floor(math.log10(ci95))))}f"
        shown = format_value(self.value, spec)
        return shown if ci95 is None or shown == MISSING else f"{shown} ± {format_value(ci95, spec.lstrip('+'))}"


def format_value(value: CellValue, spec: str) -> str:
    """Show one value: a number by `spec`, text unchanged, a truth value as yes or no, a missing value as a dash."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    shown = format(value, spec)
    reads_as_zero = "0" in shown and not any(digit in shown for digit in "123456789")
    return shown.lstrip("+-") if reads_as_zero else shown


def _check(part: Any, kind: str, *needed: str) -> None:
    """Raise ValueError for an id that names no anchor or file, and for a needed text that is empty."""
    if not _IDENTIFIER.fullmatch(part.id):
        raise ValueError(
            f"{kind} id {part.id[:80]!r}: use at most 64 lower-case letters, digits and hyphens, a letter first."
        )
    for name in needed:
        if not getattr(part, name).strip():
            raise ValueError(f"{kind} {part.id!r} needs {REQUIRED_TEXTS[name]}.")


@dataclass(frozen=True, kw_only=True)
class ReportTable:
    """A table; the first column holds row headers, `label` ("Table 6") starts the caption, `notes` are set below it.

    Raises ValueError without a caption and for a row of another length than the columns.
    """

    id: str
    caption: str
    columns: tuple[TableColumn, ...]
    rows: tuple[tuple[Cell, ...], ...]
    label: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check(self, "table", "caption")
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.id!r}, row {number}: {len(row)} cells for {len(self.columns)} columns.")


@dataclass(frozen=True)
class Paragraph:
    """Running text with inline markup (see `srbval.report.plain`)."""

    text: str


@dataclass(frozen=True)
class Heading:
    """The title of a part of a section; plain text."""

    title: str


@dataclass(frozen=True)
class Listing:
    """Short texts with inline markup."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Callout:
    """A boxed remark; a sign and a word repeat its tone's colour."""

    tone: Tone
    text: str
    title: str = ""


@dataclass(frozen=True)
class Command:
    """A command line or a file's text, set in a box of its own, letter for letter."""

    line: str


@dataclass(frozen=True)
class KeyValues:
    """Pairs of a key and a value, shown as a description list; both plain text, in the order given."""

    pairs: Mapping[str, CellValue]


@dataclass(frozen=True, kw_only=True)
class Explore:
    """A chart that scripts draw from a figure's data: `x` and the keys of `curves` are columns of its file.

    `marks` are named places on the x axis; `x_per_order` is the length of one shaft order on it.
    """

    x: str
    x_label: str
    y_label: str
    curves: Mapping[str, str]
    marks: tuple[tuple[str, float], ...] = ()
    x_per_order: float | None = None


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture (SVG) that ``draw(folder, id)`` writes with its data (CSV), and the text that replaces it (`alt`).

    `label` ("Figure 11a") starts the caption, a `synthetic` stand-in is marked above it. A figure that is not `wide`
    does not take the whole width of the text; a small picture of another figure names it (`small_of`, an id). Raises
    ValueError without alt text or caption.
    """

    id: str
    caption: str
    alt: str
    draw: Drawing
    synthetic: bool = False
    label: str = ""
    badge: Badge | None = None
    wide: bool = True
    small_of: str = ""
    explore: Explore | None = None

    def __post_init__(self) -> None:
        _check(self, "figure", "alt", "caption")

    @property
    def files(self) -> dict[str, str]:
        """Paths of `picture` and `data` in the report's folder."""
        return {"picture": f"{FIGURES_FOLDER}/{self.id}.svg", "data": f"{FIGURES_FOLDER}/{self.id}.csv"}


@dataclass(frozen=True, kw_only=True)
class FigureGrid:
    """Panels (a), (b), ... side by side in `columns`, 1 to 4, with one caption for the whole."""

    figures: tuple[Figure, ...]
    columns: int = 2
    caption: str = ""
    label: str = ""


Block = Heading | Paragraph | Listing | Callout | Command | KeyValues | ReportTable | Figure | FigureGrid


@dataclass(frozen=True, kw_only=True)
class VerdictBox:
    """The answer in plain words, first on the page: a tone, a kicker, one or two sentences, a picture, a few points.

    `blocks` follow below, callouts beside the first one if there is room.
    """

    tone: Tone
    headline: str
    kicker: str = "Verdict"
    points: tuple[str, ...] = ()
    figure: Figure | None = None
    blocks: tuple[Block, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section; `id` is its anchor. A page folds it unless it is `open`."""

    id: str
    title: str
    blocks: tuple[Block, ...] = ()
    open: bool = False

    def __post_init__(self) -> None:
        _check(self, "section")


@dataclass(frozen=True, kw_only=True)
class Report:
    """A whole report; `data` becomes ``report.json``, which also lists tables and figures.

    `generated_utc` needs a time zone. `rows` are written as CSV beside the data of figures and tables, by the name of
    the file. Raises ValueError if two parts share an id.
    """

    title: str
    generated_utc: datetime
    verdict: VerdictBox
    sections: tuple[Section, ...]
    subtitle: str = ""
    data: dict[str, Any] = field(default_factory=dict)
    rows: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.generated_utc.utcoffset() is None:
            raise ValueError("generated_utc needs a time zone: use datetime.now(UTC).")
        seen = {"verdict", "contents", "main"}  # anchors of the page itself
        parts: tuple[Section | ReportTable | Figure, ...] = (*self.sections, *self.tables(), *self.figures())
        for name in (*(part.id for part in parts), *self.rows):
            if name in seen:
                raise ValueError(f"report id {name!r} is used twice.")
            seen.add(name)

    def _blocks(self) -> Iterator[Block | None]:
        yield from (self.verdict.figure, *self.verdict.blocks)
        for section in self.sections:
            yield from section.blocks

    def figures(self) -> Iterator[Figure]:
        """The verdict's figures, then those of the sections in their order, those in grids included."""
        for block in self._blocks():
            yield from block.figures if isinstance(block, FigureGrid) else (block,) if isinstance(block, Figure) else ()

    def tables(self) -> Iterator[ReportTable]:
        """All tables in their order."""
        yield from (block for block in self._blocks() if isinstance(block, ReportTable))
