"""The benchmark as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from srbval.bench.calibration import calibrate
from srbval.bench.machine import Machine, describe_machine, load_average
from srbval.bench.processes import Processes, measure_processes
from srbval.bench.progress import Progress, silent
from srbval.bench.row import BenchRun
from srbval.bench.scenes import PAPER_STEP_S, SCENES, check_scenes
from srbval.bench.settings import FULL, Settings
from srbval.bench.speed import TouchCost, speed_rows, touch_costs
from srbval.bench.targets import Target, speed_targets
from srbval.errors import ConfigurationError
from srbval.models.solvers import SOLVERS


@dataclass(frozen=True, kw_only=True)
class BenchResult:
    """Everything one benchmark measured; `reference` is empty where only speed was asked for."""

    machine: Machine
    runs: tuple[BenchRun, ...]
    touch_costs: tuple[TouchCost, ...]
    processes: Processes | None
    targets: tuple[Target, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for a JSON file."""
        return {
            "machine": self.machine.to_dict(),
            "reference": {},
            "runs": [run.to_dict() for run in self.runs],
            "touch_costs": [cost.to_dict() for cost in self.touch_costs],
            "processes": None if self.processes is None else self.processes.to_dict(),
            "targets": [target.to_dict() for target in self.targets],
        }


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: Settings = FULL,
    processes: bool = True,
    progress: Progress = silent,
) -> BenchResult:
    """Time `solvers` on `scenes`; `processes` adds compile time, start-up and memory.

    Timed parts run one after the other on one core; the machine should have nothing else to do. Raises
    `ConfigurationError` for an unknown scene or solver; a failed run is a row with its status.
    """
    check_scenes(scenes)
    check_solvers(solvers)
    load = load_average()
    calibration = calibrate()
    rows = speed_rows(scenes, solvers, [PAPER_STEP_S], settings, calibration.seconds, progress)
    costs = touch_costs("ode4" if "ode4" in solvers else solvers[0], settings, progress)
    apart = measure_processes(settings, progress) if processes else None
    return BenchResult(
        machine=describe_machine(calibration, load),
        runs=tuple(rows),
        touch_costs=tuple(costs),
        processes=apart,
        targets=tuple(speed_targets(rows, costs, apart)),
    )


def check_solvers(names: Sequence[str]) -> None:
    """Raise `ConfigurationError` for a name that is no solver."""
    for name in names:
        if name not in SOLVERS:
            raise ConfigurationError(f"solver {name!r} is not known. Known: {', '.join(SOLVERS)}.")
