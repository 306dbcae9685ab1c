"""The main job as one call: gather the evidence, draw the report, write it."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from srbval.evidence.evidence import Evidence
from srbval.evidence.gather import gather
from srbval.progress import Progress, silent, stage
from srbval.report import FORMATS, write_report
from srbval.report.content.assemble import assemble
from srbval.report.pdf import require_typst


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
    command: str = "srbval report",
    progress: Progress = silent,
) -> MadeReport:
    """Simulate, analyse, compare, and write ``report.*`` and ``figures/`` into `folder`.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs at a time (default: one per core),
    `command` what the report names to make it again.

    Raises `ConfigurationError` for a duration too short or a missing typst, `NumericsError` for a failed run,
    `DataError` for a folder that cannot be written.
    """
    if "pdf" in formats:
        require_typst()
    from threadpoolctl import threadpool_limits

    # Cases and records run at the same time; threads of the libraries would only wait for each other.
    with tempfile.TemporaryDirectory(prefix="srbval-") as name, threadpool_limits(1):
        scratch = Path(name)
        evidence = gather(seconds=seconds, stand_in_folder=scratch, jobs=jobs, progress=progress)
        with stage(progress, "Draw the figures"):
            figures = scratch / "figures"
            figures.mkdir()
            report = assemble(evidence, figures, command=command)
        with stage(progress, "Write the report"):
            files = write_report(report, folder, formats)
    return MadeReport(evidence=evidence, files=files)
