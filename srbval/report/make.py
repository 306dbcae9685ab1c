"""The main job as one call: gather the evidence, assemble the report, write it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from srbval.report.content import assemble
from srbval.report.pdf import require_typst
from srbval.report.progress import Progress
from srbval.report.simulation_progress import SimulationProgress
from srbval.report.write import FORMATS, write_report
from srbval.validation.evidence import Evidence, gather


@dataclass(frozen=True, kw_only=True)
class Made:
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
    progress: Progress | None = None,
) -> Made:
    """Simulate, analyse, compare, and write ``report.*`` and ``figures/`` into `folder`.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs at a time (default: one a core),
    `command` what the report names to make it again. Raises `ConfigurationError` for a duration too short or a missing
    typst, `NumericsError` for a failed run, `DataError` for a folder that cannot be written.
    """
    if "pdf" in formats:
        require_typst()
    with progress or Progress(silent=True) as shown, tempfile.TemporaryDirectory(prefix="srbval-") as name:
        scratch = Path(name)
        shown.message("Looking for rig recordings, planning the runs, compiling the model")
        evidence = gather(seconds=seconds, stand_in_folder=scratch, jobs=jobs, progress=SimulationProgress(shown))
        task = shown.add("Draw the figures and write the report", total=2)
        figures = scratch / "figures"
        figures.mkdir()
        report = assemble(evidence, figures, command=command)
        shown.update(task, 1)
        files = write_report(report, folder, formats)
        shown.finish(task)
    return Made(evidence=evidence, files=files)
