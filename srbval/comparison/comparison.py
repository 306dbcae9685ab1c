"""The table of comparisons: a row for every quantity of a record of the rig that the model has too.

After ASME V&V 20 (2009): comparison error E = S - D, validation uncertainty U from numerics, inputs and data as a root
of squares. Where |E| exceeds U the model's error is resolved. It agrees only where its error is surely below a margin
fixed before: |E| + U below it (two one-sided tests, Schuirmann 1987; with U in place of 1.645 u they hold whatever the
distribution, and that of an input is as good as uniform). Between the two nothing is decided. Verdicts on single
quantities are exploratory: see `srbval.comparison.verdicts` for the cage ratio,
the study `amplitudes` for bands.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.reading.lines import Line

RIG_READING, RIG_SPEED, MOUNTING, MODEL_STARTS = "rig reading", "rig speed", "rig mounting", "model: mean of starts"
DATA_PARTS = (RIG_READING, RIG_SPEED, MOUNTING)


class ComparisonVerdict(enum.StrEnum):
    """What a comparison error and its uncertainty allow to be said."""

    RESOLVED = "resolved"
    AGREES = "agrees"
    UNDECIDED = "undecided"
    INSUFFICIENT = "insufficient data"


@dataclass(frozen=True, kw_only=True)
class QuantityValue:
    """A quantity as read from one side, model or rig, with 95 % half widths: of the reading, of the shaft's speed.

    `ci95` is None where the source states none; `speed_ci95` is what the uncertainty of the shaft's speed makes of the
    value; `first_ci95` the share of the first harmonic's reading in a level over it. `present`: whether what is read
    stands out of the noise, and `least` the value from which on it would. `line` is the fault's line that the value
    was read from, `kinematic` its value in pure rolling, `halves` the same of both halves of the
    record [2], or their log spectra, [2, bins].
    """

    value: float
    ci95: float | None = 0.0
    speed_ci95: float = 0.0
    first_ci95: float = 0.0
    present: bool = True
    least: float = -math.inf
    line: Line | None = None
    kinematic: float | None = None
    halves: NDArray[np.float64] | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One row of the table of comparisons: model and rig in `unit`, `error` and `parts` (95 %) in `error_unit`.

    `kind` groups quantities that share a bias. `scene` is the bundled scene that the model ran, at the record's speed
    and load. `used_for`: ``fit`` where anything of the model was fitted to the record, ``withheld`` where it was not
    but was seen, ``blind`` where it was predicted before it was opened. An error surely below `margin` counts as
    agreement. `verdict_override` is the verdict on a quantity that is yes or no, which has no uncertainty, or on one
    whose error has the chance `p` if the model is right.
    """

    record: str
    state: Fault
    kind: str
    quantity: str
    unit: str
    error_unit: str
    model: QuantityValue
    rig: QuantityValue
    error: float
    parts: Mapping[str, float]
    scene: str = "paper"
    used_for: str = "withheld"
    margin: float | None = None
    p: float | None = None
    verdict_override: ComparisonVerdict | None = None

    @property
    def uncertainty(self) -> float | None:
        """Validation uncertainty; None where no term of numerics or inputs is known."""
        terms = set(self.parts) - {MODEL_STARTS, *DATA_PARTS}
        return math.hypot(*self.parts.values()) if terms else None

    @property
    def data_ci95(self) -> float:
        """The data's own share of it."""
        return math.hypot(*(self.parts.get(part, 0.0) for part in DATA_PARTS))

    @property
    def both_present(self) -> bool:
        """Whether both sides show what is compared; else one level is the noise's, and nothing is compared."""
        return self.model.present and self.rig.present

    @property
    def verdict(self) -> ComparisonVerdict:
        """What error and uncertainty allow to be said."""
        if self.verdict_override is not None:
            return self.verdict_override
        uncertainty = self.uncertainty
        if uncertainty is None or self.rig.ci95 is None or not self.both_present:
            return ComparisonVerdict.INSUFFICIENT
        if abs(self.error) > uncertainty:
            return ComparisonVerdict.RESOLVED
        surely_below = self.margin is not None and abs(self.error) + uncertainty < self.margin
        return ComparisonVerdict.AGREES if surely_below else ComparisonVerdict.UNDECIDED

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        return vars(self) | {
            "defect": self.state,
            "model": self.model.value,
            "rig": self.rig.value,
            "model_present": self.model.present,
            "rig_present": self.rig.present,
            "uncertainty": self.uncertainty,
            "dominant": max(self.parts, key=lambda name: self.parts[name], default=""),
            "verdict": self.verdict,
        }


def deviation_pct(value: float, reference: float) -> float:
    """Deviation of `value` from `reference` [%]."""
    return 100 * (value / reference - 1)
