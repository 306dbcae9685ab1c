"""Tables of the report from pandas frames."""

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any

from srbval.report.blocks import Badge, Cell, CellValue, ReportTable, TableColumn, Tone

if TYPE_CHECKING:
    import pandas as pd

Title = str | tuple[str, str] | tuple[str, str, str]  # title, unit, format
WHOLE_NUMBER_FORMATS = ("d", ",d")  # a frame with gaps stores whole numbers as floats


def frame_table(
    frame: "pd.DataFrame | Iterable[Mapping[str, Any]]",
    id: str,
    caption: str,
    columns: Mapping[str, Title],
    label: str = "",
    notes: Iterable[str] = (),
) -> ReportTable:
    """Make a table with one row for each row of `frame`, a pandas frame or a list of mappings with the same keys.

    `columns` maps names of the frame's columns to (title, unit, format), the last two optional. The frame's columns
    ``X_ci95``, ``X_badge``, ``X_tone`` and ``X_note`` give the 95 % half width, the source, the judgement and the
    remark of each value in the column ``X``. Raises KeyError if the frame lacks a column.
    """
    import pandas as pd

    table = frame if isinstance(frame, pd.DataFrame) else pd.DataFrame(list(frame))
    keys, titles = ("title", "unit", "format"), dict[str, TableColumn]()
    for name, title in columns.items():
        parts = (title,) if isinstance(title, str) else title
        titles[name] = TableColumn(**dict(zip(keys, parts, strict=False)))
    missing = [name for name in titles if name not in table.columns]
    if missing and len(table):
        raise KeyError(f"table {id!r}: the frame has no column {missing[0]!r}; it has {', '.join(table.columns)}.")
    rows = (dict(zip(table.columns, row, strict=True)) for row in table.itertuples(index=False, name=None))
    return ReportTable(
        id=id,
        caption=caption,
        label=label,
        notes=tuple(filter(None, notes)),
        columns=tuple(titles.values()),
        rows=tuple(tuple(_cell(row, name, column) for name, column in titles.items()) for row in rows),
    )


def _cell(row: Mapping[str, Any], name: str, column: TableColumn) -> Cell:
    ci95, badge, tone, note = (_plain(row.get(f"{name}_{of}"), column) for of in ("ci95", "badge", "tone", "note"))
    return Cell(
        value=_plain(row[name], column),
        ci95=None if ci95 is None else float(ci95),
        badge=Badge(str(badge)) if badge else None,
        tone=Tone(str(tone)) if tone else None,
        note=str(note or ""),
    )


def _plain(value: Any, column: TableColumn) -> CellValue:
    """Convert a value of a frame to a plain Python value; a missing value (None, NaN, NaT, pandas.NA) becomes None."""
    import pandas as pd

    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, list | tuple | set | Mapping):
        raise TypeError(f"column {column.title!r}: a cell must be one value, not {type(value).__name__}.")
    if value is None or pd.isna(value):
        return None
    plain: CellValue = value.item() if hasattr(value, "item") else value
    whole = column.format in WHOLE_NUMBER_FORMATS and isinstance(plain, float) and plain.is_integer()
    return int(plain) if whole and isinstance(plain, float) else plain
