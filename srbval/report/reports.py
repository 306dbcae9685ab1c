"""The reports as one call each: gather the evidence, draw the report, write it."""

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from srbval.diagnosis.baseline import Baseline
from srbval.diagnosis.fault_naming import Naming
from srbval.errors import ConfigurationError
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis
from srbval.recordings import Recording
from srbval.report import FORMATS, Report, write_report
from srbval.report.figures.files import picture_bytes
from srbval.report.figures.style import figure_style
from srbval.report.findings.findings import Evidence
from srbval.report.findings.gather import gather
from srbval.report.findings.user_records import OwnEvidence, gather_own, own_record
from srbval.report.html import render_html
from srbval.report.model import Document
from srbval.report.pages import Page
from srbval.report.pdf import require_typst
from srbval.report.sections.assemble import assemble
from srbval.report.sections.own_report import assemble_own
from srbval.report.write import draw_figures
from srbval.storage.files import atomic_write


@dataclass(frozen=True, kw_only=True)
class MadeReport:
    """What was made: the evidence and the files by format."""

    evidence: Evidence
    files: dict[str, Path]


def make_report(
    folder: Path,
    *,
    seconds: float = 10.0,
    jobs: int | None = None,
    formats: tuple[str, ...] = FORMATS,
    appendix: bool = False,
    pages: Iterable[Page] = (),
    command: str = "srbval report",
    progress: Progress = silent,
) -> MadeReport:
    """Simulate, analyse, compare, and write ``report.*`` and ``figures/`` into `folder`, `appendix` too if wanted.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs at a time (default: one per core),
    `pages` what studies add, `command` what the report names to make it again.

    Raises `ConfigurationError` for a duration too short or a missing typst, `NumericsError` for a failed run,
    `DataError` for a folder that cannot be written.
    """
    if "pdf" in formats:
        require_typst()
    from threadpoolctl import threadpool_limits

    # Cases and records run at the same time; threads of the libraries would only wait for each other.
    with tempfile.TemporaryDirectory(prefix="srbval-") as scratch, threadpool_limits(1):
        pages = tuple(pages)
        evidence = gather(seconds=seconds, stand_in_folder=Path(scratch), pages=pages, jobs=jobs, progress=progress)
        files = _written(assemble(evidence, command=command, pages=pages), folder, formats, progress, appendix=appendix)
    return MadeReport(evidence=evidence, files=files)


@dataclass(frozen=True, kw_only=True)
class MadeOwnReport:
    """The same of a report on one's own recordings."""

    evidence: OwnEvidence
    files: dict[str, Path]


def report_recordings(
    recordings: Sequence[Recording],
    folder: Path,
    *,
    bearing: str | None = None,
    healthy: Recording | None = None,
    band_hz: tuple[float, float] | None = None,
    model: bool = True,
    all_channels: bool = False,
    largest_slip_pct: float | None = None,
    formats: tuple[str, ...] = FORMATS,
    appendix: bool = False,
    command: str = "srbval report",
    progress: Progress = silent,
) -> MadeOwnReport:
    """Write a report of a few pages on recordings of one bearing into `folder`.

    See `gather_own` for `bearing`, `healthy`, `band_hz`, `model`, `all_channels` and `largest_slip_pct`, and
    `make_report` for the rest. Raises what they raise.
    """
    if "pdf" in formats:
        require_typst()
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        evidence = gather_own(
            recordings, bearing=bearing, healthy=healthy, band_hz=band_hz, model=model, all_channels=all_channels,
            largest_slip_pct=largest_slip_pct, progress=progress,
        )  # fmt: skip
        files = _written(assemble_own(evidence, command=command), folder, formats, progress, appendix=appendix)
    return MadeOwnReport(evidence=evidence, files=files)


PLOTS = (".png", ".svg", ".html")


def check_plot(path: Path) -> None:
    """Refuse a name that `write_plot` cannot write (`ConfigurationError`), before anything is computed."""
    if path.suffix.lower() not in PLOTS:
        raise ConfigurationError(f"{path}: a picture is one of {', '.join(PLOTS)}; end its name with one of them.")


def write_plot(
    analysis: Analysis, path: Path, *, baseline: Baseline | None = None, naming: Naming | None = None,
    command: str = "srbval analyse",
) -> None:  # fmt: skip
    """One picture of an analysis as PNG or SVG (`Analysis.plot`), or with its table of lines as a page of its own."""
    check_plot(path)
    with atomic_write(path) as part, figure_style():
        if path.suffix.lower() == ".html":
            record = own_record(analysis, baseline, naming=naming)
            evidence = OwnEvidence(bearing=analysis.bearing, records=(record,), provenance={})
            page = assemble_own(evidence, command=command, brief=True)
            with tempfile.TemporaryDirectory(prefix="srbval-") as figures:
                draw_figures(page, Path(figures), (Document.MAIN,))
                part.write_text(render_html(page, Path(figures)), encoding="utf-8")
        else:
            figure = analysis.plot(healthy=None if baseline is None else baseline.analysis)
            part.write_bytes(picture_bytes(figure, path.suffix.lower()))


def _written(
    report: Report, folder: Path, formats: tuple[str, ...], progress: Progress, *, appendix: bool
) -> dict[str, Path]:
    with stage(progress, "Draw the figures and write the report"):
        return write_report(report, folder, formats, appendix=appendix)
