"""Write a report's files, all of them or none."""

import os
import tempfile
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError
from srbval.report.blocks import FIGURES, Cell, Column, Table
from srbval.report.html import render_html
from srbval.report.model import Document, Report
from srbval.report.pdf import render_pdf, require_typst
from srbval.storage.json_files import write_json

FORMATS = ("html", "pdf", "json")


def write_report(
    report: Report, folder: Path, formats: Iterable[str] = FORMATS, *, appendix: bool = False
) -> dict[str, Path]:
    """Write ``report.html``, ``report.pdf``, ``report.json`` and ``figures/`` into `folder`.

    With `appendix` also ``appendix.html`` and ``appendix.pdf``. ``report.json`` holds the tables of both whether it is
    made or not; figures are those of the documents that are made. Everything is made in a hidden folder beside and then
    moved file by file, so a failure leaves what was there before. Returns the path of each format written, those of the
    appendix as ``appendix_html``.

    Raises `ConfigurationError` for an unknown format, or for ``pdf`` without typst; `DataError` when
    `folder` cannot be written to.
    """
    wanted = tuple(formats)
    unknown = [kind for kind in wanted if kind not in FORMATS]
    if unknown:
        raise ConfigurationError(f"report format {unknown[0]!r} is not known; choose from {', '.join(FORMATS)}.")
    if "pdf" in wanted:
        require_typst()
    folder = Path(folder)
    try:
        return _write(report, folder, wanted, appendix and report.has_appendix)
    except OSError as error:
        raise DataError(
            f"the report could not be written to {folder}: {error.strerror or error} "
            f"({error.filename or folder}). Choose another folder or free some space."
        ) from error


def _write(report: Report, folder: Path, wanted: tuple[str, ...], appendix: bool) -> dict[str, Path]:
    parts = {kind: (Document.MAIN, kind) for kind in wanted}
    if appendix:
        parts |= {f"appendix_{kind}": (Document.APPENDIX, kind) for kind in wanted if kind != "json"}
    with tempfile.TemporaryDirectory(prefix=".srbval-report-", dir=_nearest_existing(folder)) as name:
        stage = Path(name)
        documents = (Document.MAIN, Document.APPENDIX) if appendix else (Document.MAIN,)
        draw_figures(report, stage, documents)
        for document, kind in parts.values():
            _render(report, document, kind, stage, documents)
        _move(stage, folder)
    return {name: folder / f"{document}.{kind}" for name, (document, kind) in parts.items()}


def draw_figures(report: Report, folder: Path, documents: Iterable[Document]) -> None:
    """Draw the figures of `documents` into ``folder/figures``."""
    for document in documents:
        for figure in report.figures(document):
            figure.draw(folder / FIGURES, figure.id)


def _render(report: Report, document: Document, kind: str, stage: Path, made: Collection[Document]) -> None:
    target, both = stage / f"{document}.{kind}", len(made) > 1
    if kind == "html":
        target.write_text(render_html(report, stage, document, with_appendix=both), encoding="utf-8")
    elif kind == "pdf":
        target.write_bytes(render_pdf(report, stage, document, with_appendix=both))
    else:
        write_json(target, report_data(report, made))


def _move(stage: Path, folder: Path) -> None:
    for path in sorted(p for p in stage.rglob("*") if p.is_file()):
        target = folder / path.relative_to(stage)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, target)


def _nearest_existing(folder: Path) -> Path:
    """`folder` or its nearest ancestor that exists: on the same file system, so that moving is atomic."""
    resolved = folder.resolve()
    return next(p for p in (resolved, *resolved.parents) if p.is_dir())


def report_data(report: Report, made: Iterable[Document] = tuple(Document)) -> dict[str, Any]:
    """The content of ``report.json``: the report's data, the tables of both documents, the figures of those `made`.

    Numbers of tables are not rounded. Columns of measured times are left empty: they differ from run to run.
    """
    drawn = {figure.id for document in made for figure in report.figures(document)}
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
        if figure.id in drawn
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
