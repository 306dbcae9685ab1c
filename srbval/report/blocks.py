"""The report as a tree of frozen dataclasses: sections of text, tables and pictures; renderers only walk it.

The source of a number (`Badge`) and its judgement (`Tone`) are words first; colour only repeats them.
"""

import enum
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from srbval.report.figures.style import Drawing

FIGURES = "figures"  # the folder of pictures and their data beside the documents
Value = float | int | str | bool | None
MISSING = "–"
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
class Column:
    """One column; `unit` is shown below the title.

    `format` is a Python format specification for numbers, such as ``.2f``; a column with a format is aligned right.
    """

    title: str
    unit: str = ""
    format: str = ""

    @property
    def align(self) -> str:
        """Alignment of the cells."""
        return "right" if self.format else "left"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One value with its source (`badge`), its judgement (`tone`) and a short remark below it (`note`).

    `ci95` is the half width of a 95 % interval in the column's unit, shown as ``value ± ci95`` with at most two digits.
    None and non-finite values show as a dash. All text is plain: no markup is read in a cell.
    """

    value: Value
    ci95: float | None = None
    badge: Badge | None = None
    tone: Tone | None = None
    note: str = ""

    def text(self, column: Column) -> str:
        """Text of the value, the same in every renderer."""
        spec, ci95 = column.format, self.ci95
        fixed = re.fullmatch(r"([+,]*)\.(\d+)f", spec)
        if fixed and ci95 and math.isfinite(ci95):
            spec = f"{fixed[1]}.{min(int(fixed[2]), max(0, 1 - math.floor(math.log10(ci95))))}f"
        shown = format_value(self.value, spec)
        return shown if ci95 is None or shown == MISSING else f"{shown} ± {format_value(ci95, spec.lstrip('+'))}"


def format_value(value: Value, spec: str) -> str:
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


def _check(identifier: str, what: str) -> None:
    """Raise ValueError unless an id, which names anchors and files, is lower-case letters, digits and hyphens."""
    if not _IDENTIFIER.fullmatch(identifier):
        raise ValueError(
            f"{what} id {identifier[:80]!r}: use at most 64 lower-case letters, digits and hyphens, a letter first."
        )


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table with a caption; the first column holds row headers.

    `label` is the bold start of the caption ("Table 6"). `notes` are set below the table; they and the caption may use
    inline markup. Raises ValueError without a caption and for a row of another length than the columns.
    """

    id: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    label: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check(self.id, "table")
        if not self.caption.strip():
            raise ValueError(f"table {self.id!r} needs a caption.")
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
    """A list of short texts with inline markup."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Callout:
    """A boxed remark; its tone is shown as a sign and a word as well as a colour."""

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

    pairs: Mapping[str, Value]


@dataclass(frozen=True, kw_only=True)
class Explore:
    """Description of a chart that scripts draw from a figure's data, to be zoomed and read off.

    `x` and the keys of `curves` are columns of the figure's data file, the values of `curves` their names; `marks` are
    named places on the x axis; `x_per_order`, if any, is the length of one shaft order on it.
    """

    x: str
    x_label: str
    y_label: str
    curves: Mapping[str, str]
    marks: tuple[tuple[str, float], ...] = ()
    x_per_order: float | None = None


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture (SVG), with the text that replaces it (`alt`).

    `draw(folder, id)` writes the picture and the plotted data (CSV) under that name, see `save_panel`. `label` is the
    bold start of the caption ("Figure 11a"). Both renderers mark a `synthetic` stand-in above the caption. A figure on
    its own takes the whole width of the text unless `wide` is False. Raises ValueError without alt text or caption.
    """

    id: str
    caption: str
    alt: str
    draw: Drawing
    synthetic: bool = False
    label: str = ""
    badge: Badge | None = None
    wide: bool = True
    explore: Explore | None = None

    def __post_init__(self) -> None:
        _check(self.id, "figure")
        for what, text in (("an alt text: describe the picture", self.alt), ("a caption", self.caption)):
            if not text.strip():
                raise ValueError(f"figure {self.id!r} needs {what}.")

    @property
    def files(self) -> dict[str, str]:
        """Paths of the `picture` and the plotted `data`, relative to the report's folder."""
        return {"picture": f"{FIGURES}/{self.id}.svg", "data": f"{FIGURES}/{self.id}.csv"}


@dataclass(frozen=True, kw_only=True)
class FigureGrid:
    """Panels (a), (b), ... side by side in `columns`, 1 to 3, with one caption for the whole."""

    figures: tuple[Figure, ...]
    columns: int = 2
    caption: str = ""
    label: str = ""


Block = Heading | Paragraph | Listing | Callout | Command | KeyValues | Table | Figure | FigureGrid


@dataclass(frozen=True, kw_only=True)
class VerdictBox:
    """The answer in plain words, first on the page: a tone, one sentence, a picture, a few points."""

    tone: Tone
    headline: str
    points: tuple[str, ...] = ()
    figure: Figure | None = None


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section; `id` is its anchor. A page folds it unless it is `open`."""

    id: str
    title: str
    blocks: tuple[Block, ...] = ()
    open: bool = False

    def __post_init__(self) -> None:
        _check(self.id, "section")


@dataclass(frozen=True, kw_only=True)
class Report:
    """A whole report.

    `generated_utc` dates the page and the PDF (time zone required). `data` becomes ``report.json``; its
    ``figures`` list is filled from the tree. `rows` are the rows behind the report, by the name of the CSV file that
    holds them beside those of figures and tables. Raises ValueError if two parts share an id.
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
        parts: tuple[Section | Table | Figure, ...] = (*self.sections, *self.tables(), *self.figures())
        for name in (*(part.id for part in parts), *self.rows):
            if name in seen:
                raise ValueError(f"report id {name!r} is used twice.")
            seen.add(name)

    def figures(self) -> Iterator[Figure]:
        """The verdict's figure, then those of the sections in their order, those in grids included."""
        if self.verdict.figure:
            yield self.verdict.figure
        for section in self.sections:
            yield from figures_in(section.blocks)

    def tables(self) -> Iterator[Table]:
        """All tables, section by section."""
        for section in self.sections:
            yield from (block for block in section.blocks if isinstance(block, Table))


def figures_in(blocks: tuple[Block, ...]) -> Iterator[Figure]:
    """The figures among some blocks, those in grids included."""
    for block in blocks:
        if isinstance(block, Figure):
            yield block
        elif isinstance(block, FigureGrid):
            yield from block.figures
