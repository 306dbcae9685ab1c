"""``srbval bench --sensitivity``: the terms of the validation uncertainty, by runs of the model."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from srbval.cli.measured import keep_and_print, this_machine
from srbval.cli.output import print_table
from srbval.report.progress import Progress
from srbval.report.simulation_progress import SimulationProgress
from srbval.storage.revision import git_revision
from srbval.storage.stored_result import SENSITIVITY
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
    result = {"machine": this_machine(), "seconds": seconds, "effects": rows, "shapes": shapes}
    whole = not options.quick
    keep_and_print(SENSITIVITY, result, options, revision=revision, whole=whole, show=lambda: _print(rows))
    return 0


def _print(rows: Sequence[Mapping[str, Any]]) -> None:
    columns = ("defect", "quantity", "kind", "term", "base", "bound", "unit")
    print_table(columns, [[_short(row[name]) for name in columns] for row in rows])


def _short(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value
