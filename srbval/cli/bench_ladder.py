"""``srbval bench --ladder``: the calibration table of the ladder of models, or its predictions put to the test."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from srbval.bench.ladder.cases import between, grid, held_out, quick_grid
from srbval.bench.ladder.measure import SECONDS, answer_store, measure_ladder
from srbval.bench.ladder.summary import summary
from srbval.cli.measured import keep_and_print, this_machine
from srbval.cli.output import print_columns, print_json
from srbval.cli.tasks import Tasks
from srbval.errors import ConfigurationError
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.held_out import check_cases, tallies
from srbval.report.progress import Progress
from srbval.storage.revision import git_revision
from srbval.storage.stored_result import HELD_OUT

LADDER_COLUMNS = {
    "question": "question",
    "model": "model",
    "scenes": "scenes",
    "unanswered": "unanswered",
    "median error [%]": "median_error_pct",
    "worst error [%]": "worst_error_pct",
    "wall s/s": "wall_per_simulated_s",
    "cheaper than full": "cheaper_than_full",
}
HELD_OUT_COLUMNS = {
    "question": "title",
    "scenes": "scenes",
    "within twice": "scenes_within_twice",
    "predictions": "predictions",
    "within": "within",
    "within twice ": "within_twice",
    "unanswered": "unanswered",
    "called enough": "promises",
    "and was not": "broken",
}


def run_ladder(options: argparse.Namespace) -> int:
    """Measure the table, print it, keep it where asked; or test the one that comes with the program."""
    if options.held_out:
        return _held_out(options)
    with Progress() as progress:
        table = measure_ladder(
            quick_grid() if options.quick else grid(),
            [] if options.quick else between(),
            seconds=options.seconds or SECONDS,
            jobs=options.jobs,
            store=answer_store(),
            progress=Tasks(progress, "Bench"),
        )
    if options.output:
        table.save(Path(options.output))
    rows = summary(table)
    if options.json:
        print_json(table.to_dict() | {"ladder": rows})
    else:
        print(f"reference: {table.reference}; {len(table.entries)} scenes of {table.seconds:g} s")
        print_columns(LADDER_COLUMNS, rows)
    return 0


def _held_out(options: argparse.Namespace) -> int:
    if options.seconds or options.quick:
        raise ConfigurationError("--held-out runs its scenes as long as the calibration's: no --seconds, no --quick.")
    revision = git_revision()
    with Progress() as progress:
        checks = check_cases(
            held_out(),
            shipped_calibration(),
            jobs=options.jobs,
            store=answer_store(),
            progress=Tasks(progress, "Bench"),
        )
    rows = [tally.to_dict() for tally in tallies(checks)]
    result = {
        "machine": this_machine(),
        "seconds": shipped_calibration().seconds,
        "reference": shipped_calibration().reference,
        "tallies": rows,
        "checks": [check.to_dict() for check in checks],
    }
    show = partial(print_columns, HELD_OUT_COLUMNS, rows)
    keep_and_print(HELD_OUT, result, options, revision=revision, whole=True, show=show)
    return 0
