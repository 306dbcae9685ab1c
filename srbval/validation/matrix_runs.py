"""The model beside each record of the validation matrix: short runs at the record's own speed and load."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from srbval.errors import SrbvalError
from srbval.models.run import Run
from srbval.recordings import State
from srbval.scene import paper_scene
from srbval.validation.analyse import Analysis
from srbval.validation.cases import Case
from srbval.validation.run_cases import Progress, run_cases

# Only the mean cage speed of these runs is used; over one second it repeats to some 1e-4.
SECONDS = 1.0
DEFECT_OF = {State.HEALTHY: "none", State.OUTER: "outer", State.INNER: "inner", State.ROLLER: "roller"}


def model_runs(
    *, jobs: int | None = None, progress: Progress | None = None
) -> Callable[[Sequence[Analysis]], Sequence[Run | str]]:
    """A function from analyses to the model's runs at their speed and load; the reason where a run failed.

    `jobs` runs at a time (default: one a core); `progress` as in `run_cases`.
    """

    def run_all(analyses: Sequence[Analysis]) -> Sequence[Run | str]:
        with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
            return list(pool.map(one, analyses))

    def one(analysis: Analysis) -> Run | str:
        try:
            case = matrix_case(analysis)
            return run_cases([case], jobs=1, progress=progress)[case.id]
        except SrbvalError as error:
            return str(error)

    return run_all


def matrix_case(analysis: Analysis) -> Case:
    """The paper's scene at the recording's measured speed, its load and the defect of its state."""
    recording, state = analysis.recording, analysis.recording.state or State.HEALTHY
    return Case(
        id=f"matrix-{recording.name}",
        purpose="beside a record of the validation matrix",
        state=state,
        scene=paper_scene(
            duration_s=SECONDS,
            shaft_speed_rad_s=2 * math.pi * analysis.speed.value_hz,
            load={"radial_n": recording.radial_n or 0.0, "axial_n": recording.axial_n or 0.0},
            defect={"kind": DEFECT_OF[state]},
        ),
    )
