"""``srbval bench --reading``: how well frequencies are read, and what the signal chain costs."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from srbval.bench.reading import QUICK_READING, ReadingBench, ReadingSettings, run_reading_bench
from srbval.cli.output import print_json, print_table
from srbval.cli.tasks import Tasks
from srbval.report.progress import Progress


def run_reading(options: argparse.Namespace) -> int:
    """Measure and print; figures beyond what is asked for are printed like the others."""
    with Progress() as progress:
        result = run_reading_bench(
            QUICK_READING if options.quick else ReadingSettings(), progress=Tasks(progress, "Bench")
        )
    if options.json:
        print_json(result.to_dict())
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
