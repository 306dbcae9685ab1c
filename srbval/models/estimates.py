"""Estimated errors of a run's results due to its time step, and their tolerances; `step_error` computes them."""

import math
from dataclasses import dataclass, replace

ERROR_TOLERANCE = {"cage": 1e-5, "band_rms": 0.05, "drive_power": 0.05}  # relative
FINER_STEP_MARGIN = 1.0  # standard errors by which an error must exceed its tolerance before a finer step is chosen
TAIL_PROBABILITY = 0.025  # probability, on either side, that an error exceeds its tolerance by chance alone
LEAST_T = 1.9  # standard errors; Student's t at this probability is 1.96 or more
MIN_DEGREES_OF_FREEDOM = 0.1  # of Student's t distribution, if one block contains all of a quantity
ORDER_UNCERTAINTY = 0.2  # relative, of an estimate: at second order the error would be 16/15 d, not 4/3 d
REFINEMENT = 4  # an error is estimated by comparison with steps so many times finer
MAX_REMAINING_SHARE = 0.5  # finer steps help if less than this share of an error remains with a quarter of the step
BLOCKS = 8  # blocks of a piece; the larger scatter of blocks and of pairs counts, because the cage's speed wanders


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Estimated relative `error` of one result due to the time step, and `scatter`, the standard error of the estimate.

    `of`: name of the result, such as "drive power"; `kind`: its kind, which has a tolerance in `ERROR_TOLERANCE`;
    `blocks`: effective number of blocks (equal parts of the run) from whose differences `scatter` is computed. It is
    less than the number of blocks, `BLOCKS`, if a few of them contain most of the quantity.
    """

    kind: str
    of: str
    error: float
    scatter: float
    blocks: float = float(BLOCKS)

    @property
    def exceeds_tolerance(self) -> bool:
        """True if the error exceeds its tolerance by more than `FINER_STEP_MARGIN` standard errors."""
        return not abs(self.error) <= ERROR_TOLERANCE[self.kind] + FINER_STEP_MARGIN * self.scatter

    def certainly_exceeds(self, limit: float | None = None) -> bool:
        """True if the error exceeds `limit` (default: its tolerance) significantly, by Student's t test."""
        within = ERROR_TOLERANCE[self.kind] if limit is None else limit
        if abs(self.error) <= within + LEAST_T * self.scatter:
            return False
        from scipy.special import stdtrit  # takes a while to load

        errors = -float(stdtrit(max(self.blocks - 1, MIN_DEGREES_OF_FREEDOM), TAIL_PROBABILITY))
        return not abs(self.error) <= within + errors * self.scatter

    @property
    def undecided(self) -> bool:
        """True if the error is neither certainly above its tolerance nor certainly within the tolerance."""
        largest = abs(self.error) * (1 + ORDER_UNCERTAINTY) + self.scatter
        return not self.certainly_exceeds() and largest > ERROR_TOLERANCE[self.kind]

    def __str__(self) -> str:
        return (
            f"{self.of} {100 * self.error:+.2g} % (standard error {100 * self.scatter:.1g} %, "
            f"limit {100 * ERROR_TOLERANCE[self.kind]:g} %)"
        )


@dataclass(frozen=True, kw_only=True)
class StepError:
    """Estimated errors due to the solver's time step: of mean cage speed, drive power and RMS of vibration by band.

    `energy`: energy missing in the energy balance of a run because of the step, divided by the dissipated energy; NaN
    if unknown. `stalled`: true if finer steps were tried and did not reduce the errors.
    """

    step_s: float
    estimates: tuple[Estimate, ...]
    energy: float = math.nan
    stalled: bool = False

    @property
    def needs_finer_steps(self) -> bool:
        """True if any error exceeds its tolerance by more than `FINER_STEP_MARGIN` standard errors."""
        return any(estimate.exceeds_tolerance for estimate in self.estimates)

    @property
    def certain_excesses(self) -> tuple[Estimate, ...]:
        """Estimated errors that exceed their tolerances significantly, by Student's t test."""
        return tuple(estimate for estimate in self.estimates if estimate.certainly_exceeds())

    @property
    def undecided_estimates(self) -> tuple[Estimate, ...]:
        """Estimated errors that are neither certainly above nor certainly within their tolerances."""
        return tuple(estimate for estimate in self.estimates if estimate.undecided)

    def improves_on(self, coarser: "StepError") -> bool:
        """True if at least one error above tolerance in `coarser` fell to less than `MAX_REMAINING_SHARE` of it."""
        return any(
            abs(own.error) < MAX_REMAINING_SHARE * abs(theirs.error)
            for own, theirs in zip(self.estimates, coarser.estimates, strict=True)
            if theirs.exceeds_tolerance
        )

    def extrapolated_to(self, finer: float) -> "StepError":
        """Expected errors with steps `finer` times shorter; errors are assumed to be proportional to the step."""
        return StepError(
            step_s=self.step_s / finer,
            energy=self.energy / finer,
            estimates=tuple(replace(e, error=e.error / finer, scatter=e.scatter / finer) for e in self.estimates),
        )

    def to_dict(self) -> dict[str, float]:
        """Largest error of each kind (cage speed, band RMS, drive power) and its standard error [%]; NaN if unknown."""
        found: dict[str, float] = {}
        for kind in ERROR_TOLERANCE:
            none = Estimate(kind=kind, of="", error=math.nan, scatter=math.nan)
            worst = max((e for e in self.estimates if e.kind == kind), key=lambda e: abs(e.error), default=none)
            found |= {f"{kind}_pct": 100 * worst.error, f"{kind}_scatter_pct": 100 * worst.scatter}
        return found
