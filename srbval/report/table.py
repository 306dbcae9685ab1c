"""Tables of the report: columns with units and formats, cells with badges and tones."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from srbval.report.badges import Badge, Tone

Value = float | int | str | bool | None
MISSING = "–"
_IDENTIFIER = re.compile(r"[a-z][a-z0-9-]{0,63}")


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
    return shown.lstrip("+-") if _is_zero(shown) else shown


def _is_zero(shown: str) -> bool:
    """Whether a formatted number reads as zero, so that it carries no sign."""
    return any(c == "0" for c in shown) and not any(c in "123456789" for c in shown)
