"""One row of a benchmark: a scene, a solver, a step; its cost and its errors."""

from dataclasses import dataclass
from typing import Any

from srbval.comparison.runs import Ended, right_hand_sides_per_step
from srbval.plan.measures import Measures
from srbval.studies.speed_accuracy.measured import MeasureErrors, RunTiming, TimedRun, plain_or_nulls


@dataclass(frozen=True, kw_only=True)
class BenchRun(Ended):
    """A row. `measures` and `errors` are None for a failed run and where only speed was asked for.

    `reference_errors` are the reference's own, by refinement; a run that is itself the reference has no `errors`.

    `timing` is None for a run that could not be timed; `calibration_s` is the machine's, in seconds. `pareto`: no other
    good run of the scene is both faster and closer in cage speed; `pareto_band`: the same for the band's vibration.
    """

    scene: str
    model: str
    solver: str
    dt_s: float
    calibration_s: float
    timing: RunTiming | None = None
    measures: Measures | None = None
    errors: MeasureErrors | None = None
    reference_errors: MeasureErrors | None = None
    pareto: bool = False
    pareto_band: bool = False

    @property
    def wall_per_simulated_s(self) -> float | None:
        """Best wall time of a simulated second [s]."""
        return None if self.timing is None else self.timing.best

    @property
    def cage_error_bound(self) -> float | None:
        """Error in cage speed, not below the reference's own error, which limits the comparison."""
        if self.errors is None or self.reference_errors is None:
            return None
        return max(self.errors.cage_error, self.reference_errors.cage_error)

    @property
    def reference_limited(self) -> bool:
        """Is the cage speed's error no larger than the reference's own, so that it is not significant?"""
        return self.errors is not None and self.cage_error_bound != self.errors.cage_error

    @property
    def rhs_per_simulated_s(self) -> float | None:
        """Evaluations of the equations of motion per simulated second."""
        per_step = right_hand_sides_per_step(self.solver)
        return None if per_step is None else per_step / self.dt_s

    @property
    def us_per_rhs(self) -> float | None:
        """Best wall time of one evaluation [us], the solver's own work included."""
        if self.wall_per_simulated_s is None or self.rhs_per_simulated_s is None:
            return None
        return 1e6 * self.wall_per_simulated_s / self.rhs_per_simulated_s

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON, flat."""
        timing = plain_or_nulls(self.timing, RunTiming)
        wall, median = timing.pop("best"), timing.pop("median")
        own = ("scene", "model", "solver", "dt_s", "rhs_per_simulated_s", "us_per_rhs", "cage_error_bound",
               "reference_limited", "status", "reason", "pareto", "pareto_band")  # fmt: skip
        return {
            **{name: getattr(self, name) for name in own},
            "wall_per_simulated_s": wall,
            "wall_median_per_simulated_s": median,
            "wall_in_calibrations": None if wall is None else wall / self.calibration_s,
            **timing,
            **plain_or_nulls(self.errors, MeasureErrors),
            **plain_or_nulls(self.measures, Measures),
        }


def row_of(scene_name: str, attempt: TimedRun, calibration_s: float) -> BenchRun:
    """The row of a timed attempt, without measures."""
    scene = attempt.scene
    return BenchRun(
        scene=scene_name,
        model=scene.model,
        solver=scene.solver.name,
        dt_s=scene.solver.step_s,
        status=attempt.status,
        reason=attempt.reason,
        calibration_s=calibration_s,
        timing=attempt.timing,
    )
