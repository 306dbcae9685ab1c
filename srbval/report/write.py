"""Write a report's files, all of them or none."""

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError
from srbval.report.blocks import FIGURES, Cell, Column, Document, Report
from srbval.report.renderers import render_html, render_pdf, require_typst
from srbval.storage.json_files import move_listed_files

FORMATS = ("html", "pdf", "json")
LISTING = "report.json"


def write_report(
    report: Report, folder: Path, formats: Iterable[str] = FORMATS, *, appendix: bool = False
) -> dict[str, Path]:
    """Write ``report.html``, ``report.pdf``, ``report.json`` and ``figures/`` into `folder`.

    With `appendix` also ``appendix.html`` and ``appendix.pdf``. ``report.json`` holds the tables of both whether it is
    made or not; figures are those of the documents that are made. Everything is made in a hidden folder beside and then
    moved file by file, so a failure leaves what was there before. ``report.json`` lists all files with their SHA-256;
    those that a former report in `folder` listed, and nobody changed, are removed unless they are written anew. Returns
    the path of each format written, those of the appendix as ``appendix_html``.

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
    documents = (Document.MAIN, Document.APPENDIX) if appendix else (Document.MAIN,)
    made = {}
    existing = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.is_dir())
    # on the file system of the folder, so that moving is atomic
    with tempfile.TemporaryDirectory(prefix=".srbval-report-", dir=existing) as name:
        stage = Path(name)
        draw_figures(report, stage, documents)
        for document in documents:
            for kind in wanted:
                target = stage / f"{document}.{kind}"
                if kind == "html":
                    target.write_text(render_html(report, stage, document, with_appendix=appendix), encoding="utf-8")
                elif kind == "pdf":
                    target.write_bytes(render_pdf(report, stage, document, with_appendix=appendix))
                elif document is not Document.MAIN:
                    continue
                made[kind if document is Document.MAIN else f"appendix_{kind}"] = folder / target.name
        move_listed_files(stage, folder, LISTING, report_data(report, documents) if "json" in wanted else None)
    return made


def draw_figures(report: Report, folder: Path, documents: Iterable[Document]) -> None:
    """Draw the figures of `documents` into ``folder/figures``."""
    for document in documents:
        for figure in report.figures(document):
            figure.draw(folder / FIGURES, figure.id)


def report_data(report: Report, made: Iterable[Document] = tuple(Document)) -> dict[str, Any]:
    """The content of ``report.json``: the report's data, the tables of both documents, the figures of those `made`.

    Numbers of tables are not rounded. Columns of measured times are left empty: they differ from run to run.
    """
    drawn = {figure.id for document in made for figure in report.figures(document)}
    figures = [
        {name: getattr(figure, name) for name in ("id", "label", "caption", "alt", "synthetic")}
        | {"file": figure.files["picture"], "data": figure.files["data"]}
        for figure in report.figures() if figure.id in drawn
    ]  # fmt: skip
    tables = [
        {name: getattr(table, name) for name in ("id", "label", "caption")}
        | {"columns": [vars(column) for column in table.columns],
           "rows": [[_cell(*pair) for pair in zip(row, table.columns, strict=True)] for row in table.rows]}
        for table in report.tables()
    ]  # fmt: skip
    return {**report.data, "tables": tables, "figures": figures}


def _cell(cell: Cell, column: Column) -> dict[str, Any]:
    """The value, and what else is known of it."""
    further = {"ci95": cell.ci95, "badge": cell.badge, "tone": cell.tone, "note": cell.note}
    value = None if column.timed else cell.value
    return {"value": value} | {key: known for key, known in further.items() if known not in (None, "")}
