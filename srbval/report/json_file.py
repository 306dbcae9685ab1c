"""The content of ``report.json``."""

from typing import Any

from srbval.report.model import Report
from srbval.report.table import Cell, Column, Table


def report_data(report: Report) -> dict[str, Any]:
    """The content of ``report.json``: the report's data, with its tables and figures as the pages show them.

    Numbers of tables are not rounded. Columns of measured times are left empty: they differ from run to run.
    """
    figures = [
        {
            "id": figure.id,
            "label": figure.label,
            "caption": figure.caption,
            "alt": figure.alt,
            "file": figure.picture_name,
            "data": figure.data_name,
            "synthetic": figure.synthetic,
        }
        for figure in report.figures()
    ]
    return {**report.data, "tables": [_table(table) for table in report.tables()], "figures": figures}


def _table(table: Table) -> dict[str, Any]:
    return {
        "id": table.id,
        "label": table.label,
        "caption": table.caption,
        "columns": [{"title": c.title, "unit": c.unit, "format": c.format, "timed": c.timed} for c in table.columns],
        "rows": [[_cell(cell, c) for cell, c in zip(row, table.columns, strict=True)] for row in table.cells],
    }


def _cell(cell: Cell, column: Column) -> dict[str, Any]:
    """The value, and what else is known of it."""
    value = None if column.timed else cell.value
    further = {"ci95": cell.ci95, "badge": cell.badge, "tone": cell.tone, "note": cell.note}
    return {"value": value} | {key: known for key, known in further.items() if known not in (None, "")}
