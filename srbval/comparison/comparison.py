"""One comparison of the model with the rig: one quantity of one fault, whatever it is read from.

After ASME V&V 20 (2009): comparison error E = S - D, validation uncertainty U from numerics, inputs and data as a root
of squares. Where |E| exceeds U the model's error is resolved. It agrees only where its error is surely below a margin
fixed before: |E| + U below it (two one-sided tests, Schuirmann 1987; with U in place of 1.645 u they hold whatever the
distribution, and that of an input is as good as uniform). Between the two nothing is decided. These verdicts on single
quantities are exploratory: `srbval.comparison.record_verdict` has the record's.
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
    """One quantity of one side, with the 95 % half width of its reading (None where the source states none), and with
    that of the shaft speed that it was divided by. `first_ci95`: the first harmonic's share of a level's.

    `line` is the fault's line that it was read from, `present` whether what is read stands out of the noise, `least`
    the value from which it would, `kinematic` what pure rolling gives. `halves` are the spectra that a spectrum's shape
    is compared by, [2, bins].
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
    """Model and rig in `unit`, `error` and the 95 % `parts` of its uncertainty in `error_unit`.

    `scene` is the bundled scene that the model ran, at the record's speed and load. Where one side is not `present`
    its level is the noise's and nothing is compared. `verdict_override` is the verdict on a quantity that is yes or
    no, which has no uncertainty, or on one whose error has a chance `p` if the model is right.
    `used_for`: `fit` of a record that anything of the model was fitted to, `withheld` of one that was not but was seen,
    `blind` of one predicted before it was opened.
    """

    kind: str
    fault: Fault
    quantity: str
    unit: str
    error_unit: str
    record: str
    model: QuantityValue
    rig: QuantityValue
    error: float
    parts: Mapping[str, float]
    verdict_override: ComparisonVerdict | None = None
    p: float | None = None
    scene: str = "paper"
    margin: float | None = None
    used_for: str = "withheld"

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
    def dominant(self) -> str:
        """The largest part; empty where there are none."""
        return max(self.parts, key=lambda name: self.parts[name], default="")

    @property
    def both_present(self) -> bool:
        """Whether both sides show what is compared."""
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
        return ComparisonVerdict.AGREES if self.within_margin else ComparisonVerdict.UNDECIDED

    @property
    def within_margin(self) -> bool:
        """Whether the error is surely below the margin."""
        known = self.uncertainty is not None and self.margin is not None and self.both_present
        return known and abs(self.error) + (self.uncertainty or 0.0) < (self.margin or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        entry = dict(vars(self))
        state = entry.pop("fault")
        return entry | {
            "state": state,
            "defect": state,
            "model": self.model.value,
            "rig": self.rig.value,
            "model_present": self.model.present,
            "rig_present": self.rig.present,
            "uncertainty": self.uncertainty,
            "dominant": self.dominant,
            "verdict": self.verdict,
        }


def deviation_pct(value: float, reference: float) -> float:
    """Deviation of `value` from `reference` [%]."""
    return 100 * (value / reference - 1)
