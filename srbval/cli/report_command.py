"""``srbval report``: the main job."""

import argparse
import time
from pathlib import Path

from srbval.cli.output import own_command, print_json
from srbval.progress import ProgressDisplay, stage


def run(options: argparse.Namespace) -> int:
    """Simulate, analyse, compare, write; prints where the files are."""
    folder = Path(options.output)
    started = time.perf_counter()
    with ProgressDisplay() as progress:
        with stage(progress, "Load the program"):
            from srbval.main_job import make_report
        made = make_report(
            folder,
            seconds=options.seconds,
            jobs=options.jobs,
            formats=("html", "json") if options.no_pdf else ("html", "pdf", "json"),
            command=own_command(),
            progress=progress,
        )
    summary = {kind: str(path) for kind, path in made.files.items()} | {"figures": str(folder / "figures")}
    if options.json:
        print_json(summary | {"wall_s": time.perf_counter() - started, "table6": made.evidence.rows})
    else:
        print("\n".join(summary.values()))
    return 0
