"""The content of ``report.json``."""

from __future__ import annotations

from typing import Any

from srbval.report.model import Report


def report_data(report: Report) -> dict[str, Any]:
    """The content of ``report.json``: the report's data, with its figures as the pages show them."""
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
    return {**report.data, "figures": figures}
