"""Speed against accuracy of the solvers: for each run its computing time, status, and error against a converged run."""

import math
from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from srbval.models.simulate import Step
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.scene import load_scene
from srbval.studies.bench import BENCH_COLUMNS, bench, with_fronts
from srbval.studies.harness import StudyResult
from srbval.sweep.scenes import PAPER, base_of

SCENES = ("interference-outer", "play0-outer", "play0-healthy", "rig-outer")
EXTENT = ((40960, 61440, 122880), 0.3, 3.0)  # as `srbval.studies.bench.Extent`


def mark_of(row: Mapping[str, Any]) -> str:
    """``the default`` or ``the paper's`` if a run has the solver and step of its scene or of the paper, else empty."""
    default = load_scene(base_of(row["scene"])).solver
    marks = {"the default": (default.name, default.step_s), "the paper's": (PAPER.solver, PAPER.step_s)}
    near = (mark for mark, (name, dt_s) in marks.items() if row["solver"] == name and math.isclose(row["dt_s"], dt_s))
    return next(near, "")


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Benchmark the solvers; the benchmark of a selection is stored only if the user names a file.

    `pareto` marks runs that no accepted run of the same scene beats in CPU time and cage-speed error.
    """
    asked, how = (options.scenes or SCENES, options.solvers or ()), {"jobs": options.jobs, "progress": progress}
    content = bench(scenes=asked[0], solvers=asked[1], extent=EXTENT, step=Step.CHECKED, **how).content
    runs = [row | {"mark": mark_of(row)} for row in with_fronts(content["runs"], "cage_error")]
    shown = sorted((row for row in runs if row["pareto"] or row["mark"]), key=lambda row: str(row["scene"]))
    columns = {title: key for title, key in BENCH_COLUMNS.items() if not key.startswith("bundled_")} | {"": "mark"}
    text = [
        "Runs that no other one beats in cost and cage error, the default and the paper's:\n",
        text_rows(shown, columns),
        f"\n{sum(row['ok'] for row in runs)} of {len(runs)} runs work, as `srbval simulate` judges them.",
        f"The paper: {PAPER.wall_s / PAPER.simulated_s:.0f} s per simulated second ({PAPER.solver}).",
    ]
    name = None if options.scenes or options.solvers else "speed_accuracy"
    return StudyResult(name=name, content=content | {"runs": runs}, text="\n".join(text))
