"""Functions that make a complete report: gather the data, make texts and figures, write the files."""

import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from srbval.campaign.run import case_numbers
from srbval.diagnosis.baseline import load_healthy
from srbval.diagnosis.records import RecordReading, RecordRequest, build_request
from srbval.monitoring import batch
from srbval.monitoring.batch import FailedFile
from srbval.monitoring.trend import Trend, trend_of
from srbval.processes.machine import one_thread
from srbval.progress import Progress, silent, stage
from srbval.recordings.file_times import record_times
from srbval.recordings.registry import RecordSource, find_shipped
from srbval.recordings.settings import with_keywords
from srbval.report.blocks import FigureGrid, Report
from srbval.report.figures.plot import analysis_figure
from srbval.report.figures.style import figure_style, picture_bytes
from srbval.report.findings.findings import gather
from srbval.report.findings.user_records import UserRecord, gather_user_records
from srbval.report.pages import Page, provenance
from srbval.report.renderers import FORMATS, check_formats, draw_figures, render_html, write_report
from srbval.report.sections.assemble import assemble
from srbval.report.sections.case import MAX_DRAWN_PAIRS, assemble_case
from srbval.report.sections.figures import pair_figures
from srbval.report.sections.trend import assemble_trend
from srbval.report.sections.user_report import assemble_user_report
from srbval.storage.files import atomic_write, check_suffix
from srbval.validation.case import ValidationCase
from srbval.validation.validate import PairReading, Validation, validate

MAX_RECORD_SECTIONS = 6  # recordings with a section; further recordings have a row in a table
PLOT = ("PNG, SVG or HTML", (".png", ".svg", ".html"))  # formats and suffixes of pictures


def make_report(
    folder: Path,
    *,
    seconds: float = 10.0,
    jobs: int | None = None,
    formats: tuple[str, ...] = FORMATS,
    pages: Sequence[Page] = (),
    command: str = "srbval report",
    progress: Progress = silent,
) -> tuple[Report, dict[str, Path]]:
    """Write the main report, which compares the paper's model with the rig; return the report, and its files by format.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the number of parallel runs (default: one per
    core). `pages` are sections of studies. `command` is printed as the command that repeats the report. Raises
    `ConfigurationError` if the duration is too short or typst is missing, `NumericsError` if a run fails, and
    `DataError` if the folder cannot be written to.
    """
    check_formats(formats)
    # Cases and records already run in parallel; threads of the libraries would only wait for each other.
    with one_thread():
        found = gather(seconds=seconds, pages=pages, jobs=jobs, progress=progress)
        report = assemble(found, command=command, pages=pages)
        return report, _written(report, folder, formats, progress)


def report(
    *sources: RecordSource,
    folder: str | Path = "srbval-report",
    formats: tuple[str, ...] = ("html", "json"),
    jobs: int | None = None,
    progress: Progress = silent,
    **options: Any,
) -> dict[str, Path]:
    """Write a report on recordings (files, folders, recordings, runs) into `folder`; return its files by format.

    Without recordings, the main report is written, with the `options` of `make_report`. With recordings, `options` are
    fields of `RecordRequest` and `RecordingSettings`, such as `healthy`, `rpm`. `formats` may also contain ``pdf``.
    """
    written: dict[str, Any] = {"formats": formats, "jobs": jobs, "command": "srbval.report", "progress": progress}
    if not sources:
        return make_report(Path(folder), **written, **options)[1]
    return report_sources(sources, Path(folder), build_request(options), **written)[1]


def report_sources(
    sources: Sequence[RecordSource],
    folder: Path,
    request: RecordRequest,
    *,
    jobs: int | None = None,
    formats: tuple[str, ...] = FORMATS,
    command: str = "srbval report",
    progress: Progress = silent,
) -> tuple[Report, dict[str, Path]]:
    """Write a report on recordings of one bearing into `folder`; return the report, and its files by format.

    For a folder or many files, a table lists all recordings, and only the most serious ones get a section. If no band
    is requested, one is chosen for each record. Files that fail are listed with the reason. Raises the errors of
    `gather_user_records` and `make_report`.
    """
    check_formats(formats)
    named = list(dict.fromkeys(str(find_shipped(one)) for one in sources if isinstance(one, str | Path)))
    requests = batch.requests_for(named, request)
    others, failed = list[dict[str, Any]](), list[FailedFile]()
    if [one.file for one in requests] != named or len(named) > MAX_RECORD_SECTIONS:
        others, failed = batch.read_records(requests, jobs=jobs, progress=progress)
        failed, _ = batch.separate_other_files(failed, named, others)
        alarms = sum(batch.summary_of(one)["alarm"] in ("yes", "check") for one in others)
        is_open = len({one["file"] for one in others}) < len(others)  # one document for each channel
        count, requests = max(1, min(alarms, MAX_RECORD_SECTIONS)), []
        for one in others[:count]:
            settings = replace(request.settings, channel=one["channel"]) if is_open else request.settings
            requests.append(replace(request, file=one["file"], settings=settings))
        others = others[count:]
    requests += batch.requests_for((one for one in sources if not isinstance(one, str | Path)), request)
    if request.healthy:
        healthy = load_healthy(request.healthy, request.settings, request.healthy_scale)
        requests = [replace(one, healthy=healthy) for one in requests]
    with one_thread():
        analysed, unread, facts = gather_user_records(requests, progress=progress)
        failed = [*unread, *failed]
        report = assemble_user_report(analysed, origin={"command": command} | facts, failed=failed, others=others)
        return report, _written(report, folder, formats, progress)


def trend(
    *sources: RecordSource,
    times: str | Path | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
    baseline: int | None = None,
    machine_class: str | None = None,
    zones_mm_s: Sequence[float] = (),
    **options: Any,
) -> Trend:
    """Compute the trend of the records of one machine: files, folders, recordings or runs, sorted by time.

    `times` is a file with the records' times (see `record_times`); without it, the runs of a simulation campaign
    are sorted by case number. For `baseline`, `machine_class` and `zones_mm_s` see `trend_of`. `options` are fields
    of `RecordRequest` and `RecordingSettings`. Files that cannot be read cause a warning.
    """
    cases = {} if times else case_numbers(sources)
    request = replace(build_request(options), one_band=True)  # levels are compared
    requests = batch.requests_for(list(cases) or sources, request)
    answers, documents = batch.answers_of(requests, jobs=jobs, progress=progress), list[dict[str, Any]]()
    for number, answer in enumerate((answers[one] for one in requests), start=1):
        if isinstance(answer, FailedFile):
            warnings.warn(with_keywords(f"not read: {answer.file}: {answer.error}"), stacklevel=2)
        else:
            documents += [one | {"file": one["file"] or f"{one['name']} {number}"} for one in answer]
    known, time_from = dict[str, datetime | float](cases), "the campaign's cases"
    if not cases:
        names = list(dict.fromkeys(one["file"] for one in documents))
        known, time_from = record_times(names, None if times is None else Path(times))
    limits: dict[str, Any] = {"baseline": baseline, "machine_class": machine_class, "zones_mm_s": zones_mm_s}
    return trend_of(documents, known, time_from=time_from, **limits)


def report_case(
    case: ValidationCase | str | Path,
    folder: str | Path,
    *,
    formats: tuple[str, ...] = FORMATS,
    command: str = "srbval validate",
    progress: Progress = silent,
) -> tuple[Validation, dict[str, Path]]:
    """Compare the pairs of a validation case, write a report into `folder`; return validation, and files by format.

    Raises the errors of `validate`, and `DataError` if the folder cannot be written to; then no file is written.
    """
    check_formats(formats)
    grids: dict[int, tuple[FigureGrid, ...]] = {}

    def found(one: PairReading) -> None:
        if len(grids) < MAX_DRAWN_PAIRS:
            grids[one.number] = pair_figures(one)

    with one_thread():
        result = validate(case, found=found, progress=progress)
        report = assemble_case(result, grids, {"command": command} | provenance())
        return result, _written(report, Path(folder), formats, progress)


def write_plot(reading: RecordReading, path: str | Path, *, command: str = "srbval analyse") -> None:
    """Draw an analysed record to `path`: as PNG, SVG, or HTML page with a table of the fault lines, by its suffix."""
    path, baseline = Path(path), reading.baseline
    check_suffix(path, *PLOT)
    if path.suffix.lower() == ".html":
        record = UserRecord(analysis=reading.analysis, baseline=baseline, verdict=reading.verdict)
        _write_page(assemble_user_report([record], origin={"command": command}), path)
    else:
        with atomic_write(path) as part, figure_style():
            figure = analysis_figure(reading.analysis, None if baseline is None else baseline.analysis)
            part.write_bytes(picture_bytes(figure, path.suffix.lower()))


def write_trend(trend: Trend, path: str | Path, *, command: str = "srbval trend") -> None:
    """Write the trend of a machine's records to `path`, as one HTML page that contains its pictures."""
    _write_page(assemble_trend(trend, {"command": command} | provenance()), Path(path))


def _write_page(page: Report, path: Path) -> None:
    with atomic_write(path) as part, tempfile.TemporaryDirectory(prefix="srbval-") as figures:
        draw_figures(page, Path(figures))
        part.write_text(render_html(page, Path(figures)), encoding="utf-8")


def _written(report: Report, folder: Path, formats: tuple[str, ...], progress: Progress) -> dict[str, Path]:
    with stage(progress, "Draw the figures and write the report"):
        return write_report(report, folder, formats)
