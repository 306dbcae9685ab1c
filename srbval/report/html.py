"""The report as one HTML file: no network, no scripts, pictures and data inside."""

from __future__ import annotations

import base64
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.report.model import Report
from srbval.report.plain import as_plain

# Data files above this are linked beside the page instead of carried inside it.
EMBEDDED_DATA_BYTES = 60_000
_MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".csv": "text/csv"}


def render_html(report: Report) -> str:
    """Render the whole page. All text is escaped by the template engine; pictures become data URIs.

    Raises FileNotFoundError when a figure's picture or data file is missing.
    """
    files = {f.picture_name: f.file for f in report.figures()}
    files |= {f.data_name: f.data for f in report.figures() if f.data and f.data_name}
    template = _environment().get_template("report.html.j2")
    return template.render(
        report=as_plain(report),
        style=_template_text("report.css"),
        picture=partial(_data_uri, files),
        data_link=partial(_data_link, files),
    )


def _environment() -> Any:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    return Environment(
        loader=FunctionLoader(_template_text),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _template_text(name: str) -> str:
    return (resources.files("srbval.report") / "templates" / name).read_text(encoding="utf-8")


def _data_uri(files: dict[str, Path], name: str) -> str:
    path = files[name]
    content = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{_MEDIA_TYPES[path.suffix]};base64,{content}"


def _data_link(files: dict[str, Path], name: str) -> str:
    """Where a click on "data" leads: inside the page for small files, beside it for large ones."""
    return _data_uri(files, name) if files[name].stat().st_size <= EMBEDDED_DATA_BYTES else name
