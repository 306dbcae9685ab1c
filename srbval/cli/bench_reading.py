"""``srbval bench --reading``: how well frequencies are read, and what the signal chain costs."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

from srbval.bench.kept import READING, keep, stamped
from srbval.bench.machine import processor_name, usable_cores
from srbval.bench.reading import QUICK_READING, ReadingBench, ReadingSettings, run_reading_bench
from srbval.cli.output import own_command, print_json, print_table
from srbval.cli.tasks import Tasks
from srbval.report.progress import Progress
from srbval.storage.revision import git_revision


def run_reading(options: argparse.Namespace) -> int:
    """Measure, keep a whole run for the report, and print; figures beyond what is asked for are printed too."""
    revision = git_revision()
    with Progress() as progress:
        result = run_reading_bench(
            QUICK_READING if options.quick else ReadingSettings(), progress=Tasks(progress, "Bench")
        )
    command = own_command()
    measured = {"machine": {"processor": processor_name(), "usable_cores": usable_cores()}, **result.to_dict()}
    content = stamped(READING, measured, command=command, revision=revision)
    if options.output or not options.quick:
        path = keep(content, Path(options.output) if options.output else None)
        print(f"kept: {path}", file=sys.stderr)
    if options.json:
        print_json(content)
    else:
        _print(result)
    return 0


def _print(result: ReadingBench) -> None:
    for rows in (result.accuracy, result.false_alarms, result.timings, result.chains):
        if not rows:
            continue
        tables = [asdict(row) for row in rows]
        print_table(tuple(tables[0]), [[_short(value) for value in table.values()] for table in tables])
        print()


def _short(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value
