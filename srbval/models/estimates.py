"""Estimated errors that a run's step leaves in its answers, against their tolerances; `step_error` estimates them."""

import math
from dataclasses import dataclass, replace

TOLERANCE = {"cage": 1e-5, "band_rms": 0.05, "drive_power": 0.05}  # relative
SIGNIFICANT = 1.0  # standard errors beyond a tolerance from which a finer step is chosen
CERTAIN = 0.025  # probability, to either side, that chance alone puts an error beyond its tolerance
LEAST_FREEDOM = 0.1  # degrees of freedom of Student's t for a single block, which shows no scatter
ORDER = 0.2  # relative uncertainty of an estimate: second order would leave 16/15 d, not 4/3 d
FINER = 4
GAIN = 0.5  # least part of an error that remains with a quarter of the step if finer steps gain nothing
BLOCKS = 8  # parts of a piece; the scatter is the larger of that of parts and of pairs: a cage's speed wanders


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
        """True if it is larger than the tolerance by more than `SIGNIFICANT` standard errors."""
        return not abs(self.error) <= TOLERANCE[self.kind] + SIGNIFICANT * self.scatter

    def certainly_beyond(self, limit: float | None = None) -> bool:
        """True if chance makes it exceed `limit`, or its tolerance, with a probability below `CERTAIN`."""
        from scipy.special import stdtrit  # takes a while to load

        errors = -float(stdtrit(max(self.blocks - 1, LEAST_FREEDOM), CERTAIN))
        return not abs(self.error) <= (TOLERANCE[self.kind] if limit is None else limit) + errors * self.scatter

    @property
    def open(self) -> bool:
        """True if it is neither certainly beyond its tolerance nor certainly within."""
        return not self.certainly_beyond() and abs(self.error) * (1 + ORDER) + self.scatter > TOLERANCE[self.kind]

    def __str__(self) -> str:
        return (
            f"{self.of} {100 * self.error:+.2g} % (standard error {100 * self.scatter:.1g} %, "
            f"limit {100 * TOLERANCE[self.kind]:g} %)"
        )


@dataclass(frozen=True, kw_only=True)
class StepError:
    """Estimated errors that the step leaves in mean cage speed, in the RMS of each band, and in drive power.

    `energy`: part of the energy balance's gap, in the losses, that finer steps would close; NaN if unknown.
    `stalled`: finer steps were tried and have the same errors.
    """

    step_s: float
    estimates: tuple[Estimate, ...]
    energy: float = math.nan
    stalled: bool = False

    @property
    def beyond(self) -> bool:
        """True if an error is beyond its tolerance by more than chance."""
        return any(estimate.beyond for estimate in self.estimates)

    @property
    def certain(self) -> tuple[Estimate, ...]:
        """Errors that are certainly beyond their tolerances."""
        return tuple(estimate for estimate in self.estimates if estimate.certainly_beyond())

    @property
    def open(self) -> tuple[Estimate, ...]:
        """Errors that are neither certainly beyond their tolerances nor certainly within."""
        return tuple(estimate for estimate in self.estimates if estimate.open)

    def gains(self, coarser: "StepError") -> bool:
        """True if an error beyond its tolerance with `coarser` steps has fallen below `GAIN` times itself."""
        return any(
            abs(own.error) < GAIN * abs(theirs.error)
            for own, theirs in zip(self.estimates, coarser.estimates, strict=True)
            if theirs.beyond
        )

    @property
    def lost(self) -> bool:
        """True if an error is as large as the quantity; the piece then began from a state made up by the step."""
        return not all(abs(estimate.error) < 1 for estimate in self.estimates)

    def with_steps(self, finer: float) -> "StepError":
        """The errors expected with so many times finer steps."""
        return StepError(
            step_s=self.step_s / finer,
            energy=self.energy / finer,
            estimates=tuple(replace(e, error=e.error / finer, scatter=e.scatter / finer) for e in self.estimates),
        )

    def with_coarser(self, coarser: "StepError") -> "StepError":
        """Each estimate averaged, by variances, with the estimate of the `coarser` pair of steps over `FINER`.

        Half of the latter is added to its scatter, because the order is uncertain.
        """
        expected = {e.of: e for e in coarser.with_steps(FINER).estimates}
        return replace(self, estimates=tuple(_mean(e, expected.get(e.of, e)) for e in self.estimates))

    def to_dict(self) -> dict[str, float]:
        """Errors and standard errors by kind [%]; for the RMS those of the band with the largest error."""
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
