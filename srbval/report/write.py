"""Write a report's files, all of them or none."""

import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import in_processes
from srbval.report.blocks import FIGURES_FOLDER, Report, ReportTable
from srbval.report.figures.style import Drawing, Panel
from srbval.report.renderers import render_html, render_pdf, require_typst
from srbval.storage.json_files import move_listed_files, to_json

FORMATS = ("html", "pdf", "json")
LISTING = "report.json"
FIGURES_PER_PROCESS = 8  # a process takes as long to start as it takes to draw some four figures


def write_report(report: Report, folder: Path, formats: Collection[str] = FORMATS) -> dict[str, Path]:
    """Write ``report.html``, ``report.pdf``, ``report.json`` and ``figures/`` into `folder`; return their paths.

    ``figures`` contains the pictures and, as CSV, their data and the report's tables. If writing fails, the former
    files remain. ``report.json`` lists all files with their SHA-256; unchanged files of a former report that are no
    longer listed are removed. For `formats` see `check_formats`. Raises `DataError` if `folder` cannot be written to.
    """
    try:
        existing = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.is_dir())
        # on the file system of the folder, so that moving is atomic
        with tempfile.TemporaryDirectory(prefix=".srbval-report-", dir=existing) as name:
            stage = Path(name)
            draw_figures(report, stage)
            for table in report.tables():
                write_csv(table, stage / FIGURES_FOLDER)
            if "html" in formats:
                (stage / "report.html").write_text(render_html(report, stage), encoding="utf-8")
            if "pdf" in formats:
                (stage / "report.pdf").write_bytes(render_pdf(report, stage))
            move_listed_files(stage, folder, LISTING, report_data(report) if "json" in formats else None)
    except OSError as error:
        raise DataError(
            f"the report could not be written to {folder}: {error.strerror or error} "
            f"({error.filename or folder}). Choose another folder or free some space."
        ) from error
    return {kind: folder / f"report.{kind}" for kind in formats}


def check_formats(formats: Collection[str]) -> None:
    """Raise `ConfigurationError` for an unknown format, or for ``pdf`` without typst."""
    if unknown := [kind for kind in formats if kind not in FORMATS]:
        raise ConfigurationError(f"report format {unknown[0]!r} is not known; choose from {', '.join(FORMATS)}.")
    if "pdf" in formats:
        require_typst()


def draw_figures(report: Report, folder: Path) -> None:
    """Draw the figures of a report into ``folder/figures``, many new ones in several processes."""
    figures = [(figure.draw, folder / FIGURES_FOLDER, figure.id) for figure in report.figures()]
    new = [one for one in figures if isinstance(one[0], Panel) and not one[0].is_stored()]
    jobs = min(usable_cores(), len(new) // FIGURES_PER_PROCESS)
    drawn = [one for one, _ in in_processes(draw_figure, new, jobs=jobs)] if jobs > 1 else []
    for one in figures:
        if one not in drawn:
            draw_figure(one)


def draw_figure(figure: tuple[Drawing, Path, str]) -> None:
    """Draw one figure, given by its drawing function, folder and name."""
    draw, folder, name = figure
    draw(folder, name)


def write_csv(table: ReportTable, folder: Path) -> None:
    """Write a table as CSV, unrounded; half widths of intervals become columns of their own."""
    import pandas as pd

    found: dict[str, list[Any]] = {}
    for place, column in enumerate(table.columns):
        title = f"{column.title}, {column.unit}" if column.unit else column.title
        title = f"{title} ({place + 1})" if title in found else title
        cells = [row[place] for row in table.rows]
        found[title] = [to_json(cell.value) for cell in cells]
        if any(cell.ci95 is not None for cell in cells):
            found[f"{title}, ±"] = [to_json(cell.ci95) for cell in cells]
    folder.mkdir(parents=True, exist_ok=True)
    text = pd.DataFrame(found).to_csv(index=False, lineterminator="\n")
    (folder / f"{table.id}.csv").write_text(text, encoding="utf-8", errors="backslashreplace")


def report_data(report: Report) -> dict[str, Any]:
    """Return the content of ``report.json``: data, tables and figures, unrounded."""
    return {**report.data, "tables": to_json(report.tables()), "figures": to_json(report.figures())}
