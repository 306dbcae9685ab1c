"""``srbval bench --sensitivity``: the terms of the validation uncertainty, by runs of the model."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

from srbval.bench.kept import SENSITIVITY, keep, stamped
from srbval.bench.machine import processor_name, usable_cores
from srbval.cli.output import own_command, print_json, print_table
from srbval.report.progress import Progress
from srbval.report.simulation_progress import SimulationProgress
from srbval.storage.revision import git_revision
from srbval.validation.sensitivity import SECONDS, measure

SHORT_SECONDS = 1.0


def run_sensitivity(options: argparse.Namespace) -> int:
    """Run every term on every fault, keep a whole run for the report, print the bounds."""
    revision = git_revision()
    seconds = options.seconds or (SHORT_SECONDS if options.quick else SECONDS)
    with Progress() as progress:
        found = measure(seconds=seconds, jobs=options.jobs, progress=SimulationProgress(progress))
    rows = [asdict(effect) for effect in found.effects]
    shapes = [asdict(effect) for effect in found.shapes]
    machine = {"processor": processor_name(), "usable_cores": usable_cores()}
    command = own_command()
    result = {"machine": machine, "seconds": seconds, "effects": rows, "shapes": shapes}
    content = stamped(SENSITIVITY, result, command=command, revision=revision)
    if options.output or not options.quick:
        path = keep(content, Path(options.output) if options.output else None)
        print(f"kept: {path}", file=sys.stderr)
    if options.json:
        print_json(content)
    else:
        columns = ("defect", "quantity", "kind", "term", "base", "bound", "unit")
        print_table(columns, [[_short(row[name]) for name in columns] for row in rows])
    return 0


def _short(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value
