"""What a section of the report may hold: text, tables, pictures, key-value lists, callouts; where each comes from.

Where a number comes from (`Badge`) and how it is judged (`Tone`) are words first: colour only repeats what the word and
the sign already say.
"""

import enum
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from srbval.report.figures.files import Drawing

PICTURES = (".svg", ".png")
FIGURES = "figures"  # the folder of pictures and their data beside the documents
Value = float | int | str | bool | None
MISSING = "–"
_IDENTIFIER = re.compile(r"[a-z][a-z0-9-]{0,63}")


class Badge(enum.StrEnum):
    """Where a value or a picture comes from."""

    MEASURED = "measured"
    PUBLISHED = "published"
    STAND_IN = "stand-in"
    SIMULATED = "simulated"
    COMPUTED = "computed"
    ASSUMED = "assumed"


class Tone(enum.StrEnum):
    """How a value, a verdict or a callout is judged; `sign` is shown beside its text."""

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
    """One column. `format` is a Python format specification for numbers, such as ``.2f`` or ``+.3g``.

    A column with a format is numeric and set to the right; `align` (``left``, ``right``, ``center``)
    overrules that. `unit` is shown below the title. `timed` values differ from run to run: report.json leaves them out.
    """

    title: str
    unit: str = ""
    format: str = ""
    align: str = ""
    timed: bool = False

    def __post_init__(self) -> None:
        if self.align not in ("", "left", "right", "center"):
            raise ValueError(f"column {self.title!r}: align {self.align!r} must be left, right or center.")

    @property
    def alignment(self) -> str:
        """Alignment to draw with."""
        return self.align or ("right" if self.format else "left")


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One value with what is known of it.

    `ci95` is the half width of a 95 % interval in the column's unit, shown as ``value ± ci95``, with no more decimals
    than give it two digits. None and non-finite values show as a dash. `badge` says where the value comes from, `tone`
    how it is judged, `note` is a short remark set smaller below it. All text is plain: no markup is read in a cell.
    """

    value: Value
    ci95: float | None = None
    badge: Badge | None = None
    tone: Tone | None = None
    note: str = ""

    def text(self, column: Column) -> str:
        """The value as every renderer shows it."""
        spec = _as_precise(column.format, self.ci95)
        shown = format_value(self.value, spec)
        if self.ci95 is None or shown == MISSING:
            return shown
        return f"{shown} ± {format_value(self.ci95, spec.lstrip('+'))}"


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table with a caption. A row may hold plain values; each becomes a `Cell`.

    `label` is the bold start of the caption ("Table 6"). The first column holds row headers unless
    `row_headers` is False. `notes` are set below the table; they and the caption may use inline markup.
    """

    id: str
    caption: str
    columns: tuple[Column, ...]
    rows: Sequence[Sequence[Cell | Value]]
    label: str = ""
    notes: tuple[str, ...] = ()
    row_headers: bool = True
    cells: tuple[tuple[Cell, ...], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_identifier(self.id, "table")
        if not self.caption.strip():
            raise ValueError(f"table {self.id!r} needs a caption.")
        if not self.columns:
            raise ValueError(f"table {self.id!r} needs at least one column.")
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.id!r}, row {number}: {len(row)} cells for {len(self.columns)} columns.")
        cells = tuple(tuple(c if isinstance(c, Cell) else Cell(value=c) for c in row) for row in self.rows)
        object.__setattr__(self, "cells", cells)


def _as_precise(spec: str, ci95: float | None) -> str:
    """A format of fixed decimals, cut to those that show two digits of the interval."""
    fixed = re.fullmatch(r"([+,]*)\.(\d+)f", spec)
    if not fixed or not ci95 or not math.isfinite(ci95):
        return spec
    return f"{fixed[1]}.{min(int(fixed[2]), max(0, 1 - math.floor(math.log10(ci95))))}f"


def check_identifier(identifier: str, what: str) -> None:
    """Raise ValueError unless an id, which names anchors and files, is lower-case letters, digits and hyphens."""
    if not _IDENTIFIER.fullmatch(identifier):
        raise ValueError(
            f"{what} id {identifier[:80]!r}: use at most 64 lower-case letters, digits and hyphens, a letter first."
        )


def format_value(value: Value, spec: str) -> str:
    """Show one value: numbers by `spec`, text as it is, truth as yes or no, nothing as a dash."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    shown = format(value, spec)
    reads_as_zero = "0" in shown and not any(digit in shown for digit in "123456789")
    return shown.lstrip("+-") if reads_as_zero else shown


@dataclass(frozen=True)
class Paragraph:
    """Running text with inline markup (see `srbval.report.inline`)."""

    text: str


@dataclass(frozen=True)
class Listing:
    """A list of short texts with inline markup, numbered or not."""

    items: tuple[str, ...]
    numbered: bool = False


@dataclass(frozen=True)
class Callout:
    """A boxed remark; its tone is shown as a sign and a word as well as a colour."""

    tone: Tone
    text: str
    title: str = ""


@dataclass(frozen=True)
class Command:
    """A command line or a file's text, set in a box of its own, letter for letter."""

    text: str


@dataclass(frozen=True)
class KeyValues:
    """Pairs of a key and a value, shown as a description list; both plain text, in the order given."""

    pairs: Mapping[str, Value]


@dataclass(frozen=True, kw_only=True)
class Explore:
    """How a page with scripts shows a figure's data again, to be zoomed and read off.

    `x` and the keys of `curves` are columns of the figure's data file, the values what the reader sees; `marks`
    are named places on the x axis; `x_per_order`, if any, is what one shaft order is on it.
    """

    x: str
    x_label: str
    y_label: str
    curves: Mapping[str, str]
    marks: tuple[tuple[str, float], ...] = ()
    x_per_order: float | None = None


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture, SVG or PNG by its `suffix`, with the text that replaces it.

    It is drawn when a document that shows it is made: `draw(folder, id)` writes the picture and the plotted data (CSV)
    under that name, see `save_panel`. `label` is the bold start of the caption ("Figure 11a"). `synthetic` marks a
    stand-in: both renderers print so above the caption. A figure on its own takes the whole width of the text unless
    `wide` is False; `explore` says how scripts may show the data. Raises ValueError without alt text or caption.
    """

    id: str
    caption: str
    alt: str
    draw: Drawing
    suffix: str = ".svg"
    synthetic: bool = False
    label: str = ""
    badge: Badge | None = None
    wide: bool = True
    explore: Explore | None = None

    def __post_init__(self) -> None:
        check_identifier(self.id, "figure")
        if not self.alt.strip():
            raise ValueError(f"figure {self.id!r} needs an alt text: say what the picture shows.")
        if not self.caption.strip():
            raise ValueError(f"figure {self.id!r} needs a caption.")
        if self.suffix not in PICTURES:
            raise ValueError(f"figure {self.id!r}: {self.suffix!r} is not one of {', '.join(PICTURES)}.")

    @property
    def picture_name(self) -> str:
        """Where the report keeps the picture, relative to its folder."""
        return f"{FIGURES}/{self.id}{self.suffix}"

    @property
    def data_name(self) -> str:
        """Where the report keeps the plotted data, relative to its folder."""
        return f"{FIGURES}/{self.id}.csv"


@dataclass(frozen=True, kw_only=True)
class FigureGrid:
    """Panels (a), (b), ... side by side in `columns`, with one caption for the whole."""

    figures: tuple[Figure, ...]
    columns: int = 2
    caption: str = ""
    label: str = ""

    def __post_init__(self) -> None:
        if not self.figures:
            raise ValueError("a figure grid needs at least one figure.")
        if not 1 <= self.columns <= 3:
            raise ValueError(f"a figure grid of {self.columns} columns: use 1, 2 or 3.")


Block = Paragraph | Listing | Callout | Command | KeyValues | Table | Figure | FigureGrid
