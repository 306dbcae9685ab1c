"""Printing measured rows as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.cli.output import print_table


def print_rows(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print an empty line and all values of the rows under their keys; four digits."""
    print()
    print_table(tuple(rows[0]), [[_rounded(value) for value in row.values()] for row in rows])


def _rounded(value: Any) -> Any:
    return float(f"{value:.4g}") if isinstance(value, float) else value
