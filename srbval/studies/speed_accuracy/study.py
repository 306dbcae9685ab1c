"""The complete benchmark."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from srbval.errors import ConfigurationError
from srbval.models.solvers import SOLVERS
from srbval.processes.machine import load_average
from srbval.progress import Progress, silent
from srbval.scene import load_scene
from srbval.storage.content_store import ContentStore
from srbval.studies.machine import Machine, calibrate, describe_machine
from srbval.studies.scenes import FULL, PAPER_STEP_S, SCENES, BenchSettings, base_of, check_scenes
from srbval.studies.speed_accuracy.processes import Processes, measure_processes
from srbval.studies.speed_accuracy.reference import SceneReference, references
from srbval.studies.speed_accuracy.row import BenchRun
from srbval.studies.speed_accuracy.speed import speed_rows
from srbval.studies.speed_accuracy.targets import Target, accuracy_targets, speed_targets
from srbval.studies.speed_accuracy.work_precision import Trajectory, trajectories, with_accuracy


@dataclass(frozen=True, kw_only=True)
class BenchResult:
    """All that a benchmark measured; `references` and `trajectories` are empty where only speed was asked for.

    `default_step_s`: of each scene.
    """

    machine: Machine
    default_step_s: dict[str, float]
    references: dict[str, SceneReference]
    runs: tuple[BenchRun, ...]
    trajectories: tuple[Trajectory, ...]
    processes: Processes | None
    targets: tuple[Target, ...]

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return {"reference" if name == "references" else name: value for name, value in vars(self).items()}


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: BenchSettings = FULL,
    processes: bool = True,
    store: ContentStore | None = None,
    accuracy: bool = True,
    progress: Progress = silent,
) -> BenchResult:
    """Time `solvers` on `scenes` and, for `accuracy`, compare them with converged references.

    `processes` adds compile time, start-up and memory; references are in the store, the user's cache by default.
    Timed parts run one after the other on one core; the machine should have nothing else to do. Raises
    `ConfigurationError` for an unknown scene or solver; a failed run is a row with its status.
    """
    check_scenes(scenes)
    check_solvers(solvers)
    load = load_average()
    calibration = calibrate()
    defaults = {name: load_scene(base_of(name)).solver.step_s for name in scenes}
    steps = step_sizes(settings, defaults.values(), accuracy=accuracy)
    rows = speed_rows(scenes, solvers, steps, settings, calibration.seconds, progress)
    measured_processes = measure_processes(settings, progress) if processes else None
    found: dict[str, SceneReference] = {}
    paths: list[Trajectory] = []
    if accuracy:
        found = references(scenes, settings, store=store, progress=progress)
        rows = with_accuracy(rows, found, settings, progress)
        paths = trajectories(scenes, solvers, settings, progress)
    return BenchResult(
        machine=describe_machine(calibration, calibrate(), load),
        default_step_s=defaults,
        references=found,
        runs=tuple(rows),
        trajectories=tuple(paths),
        processes=measured_processes,
        targets=(*speed_targets(rows, measured_processes), *(accuracy_targets(rows) if accuracy else ())),
    )


def step_sizes(settings: BenchSettings, defaults_s: Iterable[float], *, accuracy: bool) -> list[float]:
    """Step sizes to run at [s], descending: the study's, or only the paper's, and the scenes' default ones."""
    steps = [1 / n for n in settings.steps] if accuracy else [PAPER_STEP_S]
    for default_s in defaults_s:
        if not any(math.isclose(default_s, step, rel_tol=1e-6) for step in steps):
            steps.append(default_s)
    return sorted(steps, reverse=True)


def check_solvers(names: Sequence[str]) -> None:
    """Raise `ConfigurationError` for a name that is no solver."""
    for name in names:
        if name not in SOLVERS:
            raise ConfigurationError(f"solver {name!r} is not known. Known: {', '.join(SOLVERS)}.")
