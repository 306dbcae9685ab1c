"""Aligned tables of plain text for a terminal."""

import math
from collections.abc import Mapping, Sequence


def text_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Table of aligned columns as text; numbers are aligned right, with six significant digits."""
    texts = [list(columns), *([_text(value) for value in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    right = [bool(rows) and all(isinstance(row[i], int | float | None) for row in rows) for i in range(len(columns))]
    return "\n".join(
        "  ".join(t.rjust(w) if r else t.ljust(w) for t, w, r in zip(line, widths, right, strict=True)).rstrip()
        for line in texts
    )


def format_uncertain(value: float | None, ci95: float | None) -> str | None:
    """Format ``value ± ci95``, rounded to two significant digits of the 95 % half width; None if either is None."""
    if value is None or ci95 is None:
        return None
    if ci95 == 0:
        return f"{value:.6g}"
    decimals = max(0, 1 - math.floor(math.log10(ci95)))
    return f"{value:.{decimals}f} ± {ci95:.{decimals}f}"


def text_rows(rows: Sequence[Mapping[str, object]], columns: Mapping[str, str] | None = None) -> str:
    """Table of the rows as text; `columns` maps titles to keys (default: all keys); four significant digits."""
    shown = columns or {key: key for key in rows[0]} if rows else {}
    values = ([row[key] for key in shown.values()] for row in rows)
    return text_table(tuple(shown), [[float(f"{v:.4g}") if isinstance(v, float) else v for v in row] for row in values])


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.6g}"
    return "".join(c if c.isprintable() else "?" for c in str(value))
