"""``srbval report``: the main job."""

from __future__ import annotations

import argparse
import importlib.util
import shlex
import sys
import tempfile
import threading
import time
from pathlib import Path

from srbval.cli.output import print_json
from srbval.errors import ConfigurationError
from srbval.report.progress import Progress
from srbval.validation.cases import Case
from srbval.validation.evidence import SHORTEST_S, Evidence


def run(options: argparse.Namespace) -> int:
    """Simulate, analyse, compare, write; prints where the files are."""
    _check(options)
    folder = Path(options.output)
    formats = ("html", "json") if options.no_pdf else ("html", "pdf", "json")
    started = time.perf_counter()
    with Progress() as progress, tempfile.TemporaryDirectory(prefix="srbval-") as scratch:
        evidence = _gather(options, Path(scratch), progress)
        written = _write(evidence, folder, Path(scratch), formats, progress)
    summary = {kind: str(path) for kind, path in written.items()} | {"figures": str(folder / "figures")}
    if options.json:
        print_json(
            summary
            | {"wall_s": time.perf_counter() - started, "table6": [r.to_dict() for r in evidence.rows]}
        )
    else:
        print("\n".join(summary.values()))
    return 0


def _check(options: argparse.Namespace) -> None:
    if options.seconds < SHORTEST_S:
        raise ConfigurationError(
            f"--seconds {options.seconds:g} is too short to tell fault lines from shaft harmonics; use {SHORTEST_S:g} "
            "or more."
        )
    if options.jobs is not None and options.jobs < 1:
        raise ConfigurationError(f"--jobs {options.jobs} must be 1 or more.")
    if not options.no_pdf and importlib.util.find_spec("typst") is None:
        raise ConfigurationError('the PDF needs typst: pip install "srbval[pdf]", or use --no-pdf.')


def _gather(options: argparse.Namespace, scratch: Path, progress: Progress) -> Evidence:
    from srbval.validation.evidence import gather

    tasks: dict[str, int] = {}
    lock = threading.Lock()

    def simulated(case: Case, done: float) -> None:
        total = case.scene.settle_s + case.scene.duration_s
        with lock:
            if case.id not in tasks:
                tasks[case.id] = progress.add(f"Simulate {case.id}", total=total)
        progress.update(tasks[case.id], done)
        if done >= total * (1 - 1e-9):
            progress.finish(tasks[case.id])

    progress.message("Looking for rig recordings, planning the runs, compiling the model")
    return gather(seconds=options.seconds, stand_in_folder=scratch, jobs=options.jobs, progress=simulated)


def _write(
    evidence: Evidence, folder: Path, scratch: Path, formats: tuple[str, ...], progress: Progress
) -> dict[str, Path]:
    from srbval.report.content import assemble
    from srbval.report.write import write_report

    task = progress.add("Draw the figures and write the report", total=2)
    figures = scratch / "figures"
    figures.mkdir()
    report = assemble(evidence, figures, command=shlex.join(["srbval", *sys.argv[1:]]))
    progress.update(task, 1)
    written = write_report(report, folder, formats)
    progress.finish(task)
    return written
