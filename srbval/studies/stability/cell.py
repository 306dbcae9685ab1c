"""One cell of the map: the run's own status and its comparison with the converged run; planted failures."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from srbval.models.health import LEAST_SHARE
from srbval.models.run import USABLE, RunStatus
from srbval.models.step_error import Estimate
from srbval.studies.outcomes import RunOutcome
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.stability.grid import StabilityCase, StabilityGroup
from srbval.studies.stability.reference import StabilityReference, relative
from srbval.studies.stability.step_limits import StepLimits

CAGE_LIMIT = 0.01  # relative, from the converged run
# Part of the converged run's load that the rollers must carry, and may: below, load is lost; above, they bounce harder
# than they should. Rattling rollers make 1.06 of imex2 at its default step and 1500 rpm (4 s), a lost run makes 1.9 up.
LOAD_RANGE = (0.95, 1.1)
UNLIKE = "unlike-reference"  # the run passed its own tests, the comparison did not
NO_REFERENCE = "no-reference"
# Silent failures, as solver and step over the paper's: all rollers end out of contact, acceleration zero, no NaN.
PLANTED = (("ode1", 2), ("ode1", 4), ("ode2", 4))
PLANTED_RPM = (710.0, 3000.0)


@dataclass(frozen=True, kw_only=True)
class StabilityCell:
    """A run of the map. `limits` are what linear theory predicts for its solver; `points_per_step` see `to_dict`."""

    case: StabilityCase
    model: str
    outcome: RunOutcome
    reference: StabilityReference
    limits: StepLimits
    points_per_step: float

    @property
    def cage_error(self) -> float:
        """Relative difference in cage speed from the converged run; NaN where there is none."""
        return abs(relative(self.outcome.cage_ratio, self.reference.fine.cage_ratio) - 1)

    @property
    def load_part(self) -> float:
        """Load on the rollers over that of the converged run."""
        return relative(self.outcome.load_share, self.reference.fine.load_share)

    @property
    def band_rms_part(self) -> float:
        """Vibration in the band over that of the converged run."""
        return relative(self.outcome.band_rms_m_s2, self.reference.fine.band_rms_m_s2)

    @property
    def beyond(self) -> tuple[Estimate, ...]:
        """Errors in cage speed, band levels and drive power that are beyond their tolerance by more than chance."""
        return self.outcome.beyond(self.reference.fine)

    @property
    def like_reference(self) -> bool:
        """Are cage and load within their limits? Not a number is no. Loads that are next to nothing are alike."""
        idle = max(abs(self.outcome.load_share), abs(self.reference.fine.load_share)) < LEAST_SHARE
        return self.cage_error <= CAGE_LIMIT and (idle or LOAD_RANGE[0] <= self.load_part <= LOAD_RANGE[1])

    @property
    def status(self) -> str:
        """The run's own, where neither it nor the comparison found anything wrong: ``ok``, or what its bearing does.

        ``inaccurate``: cage and load are right, but an error is beyond its tolerance.
        """
        if not self.outcome.ok:
            return self.outcome.status
        if self.reference.flagged:
            return NO_REFERENCE
        if not self.like_reference:
            return UNLIKE
        return RunStatus.INACCURATE.value if self.beyond else self.outcome.status

    @property
    def ok(self) -> bool:
        """Are its cage speed, band levels and drive power within the tolerances of `step_error`?"""
        return self.status in USABLE and self.status != RunStatus.INACCURATE.value

    @property
    def stable(self) -> bool:
        """Does the run stay with the converged one in cage and load? Also where its energy does not close.

        Nearest to what the paper calls stable; not enough for `ok`, as friction may chatter.
        """
        return self.status in USABLE or (self.status == RunStatus.ENERGY_OPEN.value and self.like_reference)

    @property
    def reason(self) -> str:
        """The run's own reason, or what the comparison found."""
        if self.status == NO_REFERENCE:
            return "the converged run to compare with failed"
        if self.status == RunStatus.INACCURATE.value and self.beyond:
            return f"cage and load are right, but beyond the tolerance: {'; '.join(map(str, self.beyond))}"
        if self.status != UNLIKE:
            return self.outcome.reason
        return (
            f"the run's own tests passed, but its cage is {self.cage_error:.2%} off (limit {CAGE_LIMIT:.0%}) and its "
            f"rollers carry {self.load_part:.1%} of the converged run's load "
            f"(allowed: {LOAD_RANGE[0]:.0%} to {LOAD_RANGE[1]:.0%})"
        )

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON, flat. `points_per_step`: points of the inner race that pass a roller per step."""
        outcome = self.outcome
        own = ("model", "status", "reason", "like_reference", "stable", "cage_error", "load_part", "band_rms_part",
               "points_per_step")  # fmt: skip
        measured = ("energy_imbalance", "cage_ratio", "load_share", "seconds", "wall_s")
        return {
            **vars(self.case.group),
            "solver": self.case.solver,
            "dt_s": self.case.step_s,
            **{name: getattr(self, name) for name in own},
            "predicted_limit_dt_s": self.limits.whole_s,
            "predicted_elastic_limit_dt_s": self.limits.elastic_s,
            "run_status": outcome.status,
            **{name: getattr(outcome, name) for name in measured},
            "errors": {e.of: e.error for e in outcome.errors_against(self.reference.fine)},
        }


@dataclass(frozen=True, kw_only=True)
class Planted(StabilityGroup):
    """A planted failure: detected (`caught`) where the run's own status is not usable."""

    JSON_PROPERTIES: ClassVar = ("caught",)

    solver: str
    dt_s: float
    run_status: str

    @property
    def caught(self) -> bool:
        """Did the run detect it itself?"""
        return self.run_status not in USABLE


def planted_in(cells: Sequence[StabilityCell]) -> tuple[Planted, ...]:
    """The planted failures among `cells`."""
    return tuple(
        Planted(
            **vars(cell.case.group), solver=cell.case.solver, dt_s=cell.case.step_s, run_status=cell.outcome.status
        )
        for cell in cells
        if _is_planted(cell)
    )  # fmt: skip


def _is_planted(cell: StabilityCell) -> bool:
    times = cell.case.step_s / PAPER_STEP_S
    known = any(cell.case.solver == solver and math.isclose(times, n, rel_tol=1e-6) for solver, n in PLANTED)
    return known and cell.case.group.rpm in PLANTED_RPM
