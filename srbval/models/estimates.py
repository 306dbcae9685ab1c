"""Estimated errors that a run's step leaves in its answers, against their tolerances; `step_error` estimates them."""

import math
from dataclasses import dataclass, replace

TOLERANCE = {"cage": 1e-5, "band_rms": 0.05, "drive_power": 0.05}  # relative
SIGNIFICANT = 1.0  # standard errors beyond a tolerance, for which a finer step is chosen
CERTAIN = 0.025  # probability, to either side, that chance alone puts an error beyond its tolerance
LEAST_FREEDOM = 0.1  # of Student's t: a single block says nothing
ORDER = 0.2  # of an estimate, by which it is unsure: second order would leave 16/15 d in place of 4/3 d
FINER = 4
GAIN = 0.5  # least part of an error that remains with a quarter of the step, where finer steps gain nothing
BLOCKS = 8  # of a piece; the scatter is the larger of what they say and what pairs of them say: a cage's speed wanders


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An estimated relative error, with sign, and its standard error from `blocks`; `kind` is a key of `TOLERANCE`."""

    kind: str
    of: str
    error: float
    scatter: float
    blocks: float = float(BLOCKS)

    @property
    def beyond(self) -> bool:
        """Is it larger than the tolerance, by more than `SIGNIFICANT` standard errors?"""
        return not abs(self.error) <= TOLERANCE[self.kind] + SIGNIFICANT * self.scatter

    def certainly_beyond(self, limit: float) -> bool:
        """Is it larger than `limit`, by more than chance does in `CERTAIN` of cases?"""
        from scipy.special import stdtrit  # takes a while to load

        errors = -float(stdtrit(max(self.blocks - 1, LEAST_FREEDOM), CERTAIN))
        return not abs(self.error) <= limit + errors * self.scatter

    @property
    def certain(self) -> bool:
        """Is it certainly larger than the tolerance?"""
        return self.certainly_beyond(TOLERANCE[self.kind])

    @property
    def open(self) -> bool:
        """Is it neither certainly beyond its tolerance nor certainly within?"""
        return not self.certain and abs(self.error) * (1 + ORDER) + self.scatter > TOLERANCE[self.kind]

    def __str__(self) -> str:
        return (
            f"{self.of} {100 * self.error:+.2g} % (standard error {100 * self.scatter:.1g} %, "
            f"limit {100 * TOLERANCE[self.kind]:g} %)"
        )


@dataclass(frozen=True, kw_only=True)
class StepError:
    """Estimated errors that the step leaves in mean cage speed, in the RMS of each band, and in drive power.

    `energy`: part of the energy balance's gap, in the losses, that finer steps would close; NaN where it is not known.
    `stalled`: finer steps were tried and have the same errors.
    """

    step_s: float
    estimates: tuple[Estimate, ...]
    energy: float = math.nan
    stalled: bool = False

    @property
    def beyond(self) -> bool:
        """Is any of them beyond its tolerance, by more than chance?"""
        return any(estimate.beyond for estimate in self.estimates)

    @property
    def certain(self) -> tuple[Estimate, ...]:
        """What is beyond it, however chance may have it."""
        return tuple(estimate for estimate in self.estimates if estimate.certain)

    @property
    def open(self) -> tuple[Estimate, ...]:
        """What is not established."""
        return tuple(estimate for estimate in self.estimates if estimate.open)

    def gains(self, coarser: "StepError") -> bool:
        """Has any of the errors that were beyond tolerance with `coarser` steps become less by more than `GAIN`?"""
        return any(
            abs(own.error) < GAIN * abs(theirs.error)
            for own, theirs in zip(self.estimates, coarser.estimates, strict=True)
            if theirs.beyond
        )

    @property
    def lost(self) -> bool:
        """Is an error as large as the thing itself? The piece then began from a state that the step made up."""
        return not all(abs(estimate.error) < 1 for estimate in self.estimates)

    def with_steps(self, finer: float) -> "StepError":
        """The same with so many times finer steps."""
        return StepError(
            step_s=self.step_s / finer,
            energy=self.energy / finer,
            estimates=tuple(replace(e, error=e.error / finer, scatter=e.scatter / finer) for e in self.estimates),
        )

    def with_coarser(self, coarser: "StepError") -> "StepError":
        """Each estimate's mean with what the `coarser` pair of steps says, `FINER` times less, by their variances.

        To what is carried over half of itself is added as its scatter: the order is not that sure.
        """
        expected = {e.of: e for e in coarser.with_steps(FINER).estimates}
        return replace(self, estimates=tuple(_mean(e, expected.get(e.of, e)) for e in self.estimates))

    def to_dict(self) -> dict[str, float]:
        """In per cent by kind, the band with the largest error for the RMS, and its standard error."""
        found = {}
        for kind in TOLERANCE:
            worst = max((e for e in self.estimates if e.kind == kind), key=lambda e: abs(e.error), default=None)
            found[f"{kind}_pct"] = math.nan if worst is None else 100 * worst.error
            found[f"{kind}_scatter_pct"] = math.nan if worst is None else 100 * worst.scatter
        return found


def _mean(own: Estimate, expected: Estimate) -> Estimate:
    if expected is own:
        return own
    variance, of_expected = own.scatter**2, expected.scatter**2 + (0.5 * expected.error) ** 2
    if not (0 < variance < math.inf and 0 < of_expected < math.inf):
        return own
    share = of_expected / (variance + of_expected)
    error = share * own.error + (1 - share) * expected.error
    return replace(own, error=error, scatter=math.sqrt(share * variance))
