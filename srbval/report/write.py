"""Write a report's files, all of them or none."""

import base64
import tempfile
from collections.abc import Collection
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import usable_cores
from srbval.processes.pool import in_processes
from srbval.report.blocks import FIGURES_FOLDER, Report, ReportTable
from srbval.report.figures.style import Drawing, Panel
from srbval.report.plain import as_plain
from srbval.report.renderers import list_pdf_dependencies, render_html, render_pdf, require_typst
from srbval.storage.content_store import ContentStore, content_sha256
from srbval.storage.json_files import move_listed_files, to_json

FORMATS = ("html", "pdf", "json")
LISTING = "report.json"
FIGURES_PER_PROCESS = 8  # a process takes as long to start as it takes to draw some four figures
REPORT_STORE = ContentStore(kind="report", computed_by=__name__)


def write_report(report: Report, folder: Path, formats: Collection[str] = FORMATS) -> dict[str, Path]:
    """Write ``report.html``, ``report.pdf``, ``report.json`` and ``figures/`` into `folder`; return their paths.

    ``figures`` contains the pictures, their data as CSV, the report's tables and `rows` (see `Report`). If writing
    fails, the former files remain. ``report.json`` lists all files with their SHA-256; unchanged files of a former
    report that are no longer listed are removed. If the report's content is unchanged, its time and its PDF are kept.
    For `formats` see `check_formats`. Raises `DataError` if `folder` cannot be written to.
    """
    try:
        return _write(report, folder, formats)
    except OSError as error:
        raise DataError(
            f"the report could not be written to {folder}: {error.strerror or error} "
            f"({error.filename or folder}). Choose another folder or free some space."
        ) from error


def check_formats(formats: Collection[str]) -> None:
    """Raise `ConfigurationError` for an unknown format, or for ``pdf`` without typst."""
    if unknown := [kind for kind in formats if kind not in FORMATS]:
        raise ConfigurationError(f"report format {unknown[0]!r} is not known; choose from {', '.join(FORMATS)}.")
    if "pdf" in formats:
        require_typst()


def _write(report: Report, folder: Path, formats: Collection[str]) -> dict[str, Path]:
    existing = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.is_dir())
    # on the file system of the folder, so that moving is atomic
    with tempfile.TemporaryDirectory(prefix=".srbval-report-", dir=existing) as name:
        stage = Path(name)
        draw_figures(report, stage)
        write_csv_tables(report, stage / FIGURES_FOLDER)
        content = _content(report, stage)
        known: dict[str, str] = REPORT_STORE.load(content, dict) or {"generated_utc": report.generated_utc.isoformat()}
        report = replace(report, generated_utc=datetime.fromisoformat(known["generated_utc"]))
        if "html" in formats:
            (stage / "report.html").write_text(render_html(report, stage), encoding="utf-8")
        if "pdf" in formats:
            known["pdf"] = known.get("pdf") or base64.b64encode(render_pdf(report, stage)).decode()
            (stage / "report.pdf").write_bytes(base64.b64decode(known["pdf"]))
        REPORT_STORE.save(content, known)
        move_listed_files(stage, folder, LISTING, report_data(report) if "json" in formats else None)
    return {kind: folder / f"report.{kind}" for kind in formats}


def _content(report: Report, stage: Path) -> str:
    """Hash all content of a report except its time; the folder `stage` contains the figures already drawn."""
    files = {path.name: path.read_bytes() for path in sorted((stage / FIGURES_FOLDER).iterdir())}
    page = as_plain(report) | {"generated": ""}
    return content_sha256(page, report_data(report), files, *list_pdf_dependencies())


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


def write_csv_tables(report: Report, folder: Path) -> None:
    """Write a report's tables and `rows` (see `Report`) as CSV, unrounded; columns that contain lists are left out."""
    import pandas as pd

    frames = {table.id: pd.DataFrame(_csv_columns(table)) for table in report.tables()}
    for name, rows in report.rows.items():
        frame = pd.json_normalize(to_json(list(rows)))
        frames[name] = frame.drop(columns=[key for key in frame if any(isinstance(x, list) for x in frame[key])])
    folder.mkdir(parents=True, exist_ok=True)
    for name, frame in frames.items():
        text = frame.to_csv(index=False, lineterminator="\n")
        (folder / f"{name}.csv").write_text(text, encoding="utf-8", errors="backslashreplace")


def _csv_columns(table: ReportTable) -> dict[str, list[Any]]:
    """Return the values of a table by column title; half widths of intervals become columns of their own."""
    found: dict[str, list[Any]] = {}
    for place, column in enumerate(table.columns):
        title = f"{column.title}, {column.unit}" if column.unit else column.title
        title = f"{title} ({place + 1})" if title in found else title
        cells = [row[place] for row in table.rows]
        found[title] = [to_json(cell.value) for cell in cells]
        if any(cell.ci95 is not None for cell in cells):
            found[f"{title}, ±"] = [to_json(cell.ci95) for cell in cells]
    return found


def report_data(report: Report) -> dict[str, Any]:
    """Return the content of ``report.json``: data, tables and figures, unrounded."""
    return {**report.data, "tables": to_json(report.tables()), "figures": to_json(report.figures())}
