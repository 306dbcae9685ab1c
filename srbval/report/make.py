"""The main job as one call: gather the evidence, assemble the report, write it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from srbval.evidence.gather import Evidence, gather
from srbval.models.kernel_cache import is_compiled, precompile
from srbval.progress import Progress, silent, stage
from srbval.report.content import assemble
from srbval.report.pdf import require_typst
from srbval.report.write import FORMATS, write_report
from srbval.storage.stored_result import SENSITIVITY, newest_result
from srbval.validation.effects import Sensitivity, sensitivity_of


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
    progress: Progress = silent,
) -> Made:
    """Simulate, analyse, compare, and write ``report.*`` and ``figures/`` into `folder`.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs at a time (default: one a core),
    `command` what the report names to make it again; `progress` gets what is being done.

    Raises `ConfigurationError` for a duration too short or a missing typst, `NumericsError` for a failed run,
    `DataError` for a folder that cannot be written.
    """
    if "pdf" in formats:
        require_typst()
    from threadpoolctl import threadpool_limits

    # Cases and records run side by side; threads of the libraries would only wait for each other.
    with tempfile.TemporaryDirectory(prefix="srbval-") as name, threadpool_limits(1):
        scratch = Path(name)
        if not is_compiled("full"):
            with stage(progress, "Compile the model, once after installation"):
                precompile("full")
        evidence = gather(
            seconds=seconds,
            stand_in_folder=scratch,
            jobs=jobs,
            progress=progress,
            known=_stored_sensitivity(),
        )
        figures = scratch / "figures"
        figures.mkdir()
        with stage(progress, "Draw the figures"):
            report = assemble(evidence, figures, command=command)
        with stage(progress, "Write the report"):
            files = write_report(report, folder, formats)
    return Made(evidence=evidence, files=files)


def _stored_sensitivity() -> Sensitivity:
    """What numerics and inputs do to the compared quantities, as last measured; empty where it never was."""
    kept = newest_result(SENSITIVITY)
    return sensitivity_of(kept.content) if kept else Sensitivity()
