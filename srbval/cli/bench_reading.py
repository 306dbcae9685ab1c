"""``srbval bench --reading``: how well frequencies are read, and what the signal chain costs."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from srbval.bench.machine import usable_cores
from srbval.bench.reading import QUICK_READING, ReadingBench, ReadingSettings, run_reading_bench
from srbval.cli.measured import keep_and_print, this_machine
from srbval.cli.output import print_table
from srbval.cli.tasks import Tasks
from srbval.report.progress import Progress
from srbval.storage.revision import git_revision
from srbval.storage.stored_result import READING
from srbval.storage.strict_json import json_object


def run_reading(options: argparse.Namespace) -> int:
    """Measure, keep a whole run for the report, and print; figures beyond what is asked for are printed too."""
    revision = git_revision()
    with Progress() as progress:
        result = run_reading_bench(
            QUICK_READING if options.quick else ReadingSettings(),
            jobs=options.jobs or usable_cores(),
            progress=Tasks(progress, "Bench"),
        )
    measured = {"machine": this_machine(), **json_object(result)}
    whole = not options.quick
    keep_and_print(READING, measured, options, revision=revision, whole=whole, show=lambda: _print(result))
    return 0


def _print(result: ReadingBench) -> None:
    for rows in (result.accuracy, result.false_alarms, result.timings, result.chains, result.transforms):
        if not rows:
            continue
        tables = [asdict(row) for row in rows]
        print_table(tuple(tables[0]), [[_short(value) for value in table.values()] for table in tables])
        print()


def _short(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value
