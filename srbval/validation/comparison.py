"""One comparison of a simulated line with a measured or published one: a row of Table 6.

After ASME V&V 20 (2009): comparison error E = S - D, validation uncertainty U from numerics, inputs and data.
Where |E| exceeds U the model's error is resolved; otherwise it is lost in the uncertainty.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


class RigSource(enum.StrEnum):
    """Where a rig value comes from."""

    MEASURED = "measured"
    PUBLISHED = "published"


class ComparisonVerdict(enum.StrEnum):
    """What a comparison error and its uncertainty allow to be said."""

    RESOLVED = "resolved"
    NOT_RESOLVED = "not resolved from uncertainty"
    INSUFFICIENT = "insufficient data"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A row of Table 6. Frequencies [Hz], intervals 95 % half widths, deviations and uncertainties [%].

    `kinematic_hz` is printed at the paper's speed, computed at the rig recordings'. `*_deviation_pct` are
    recomputed from the frequencies; `*_printed_pct` are the paper's. `rig_shaft_rpm` is the measured speed,
    None where the paper gives none. `uncertainty_parts_pct` lists what `validation_uncertainty_pct` combines.
    """

    defect: str
    line: str
    shaft_rpm: float
    kinematic_hz: float
    model_hz: float
    model_ci95_hz: float
    model_cage_hz: float
    rig_hz: float
    rig_source: RigSource
    rig_ci95_hz: float | None = None
    rig_shaft_rpm: float | None = None
    paper_model_hz: float | None = None
    paper_rig_hz: float | None = None
    paper_model_printed_pct: float | None = None
    paper_rig_printed_pct: float | None = None
    uncertainty_parts_pct: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def model_deviation_pct(self) -> float:
        """Model from kinematic [%]."""
        return deviation_pct(self.model_hz, self.kinematic_hz)

    @property
    def rig_deviation_pct(self) -> float:
        """Rig from kinematic [%]."""
        return deviation_pct(self.rig_hz, self.kinematic_hz)

    @property
    def comparison_error_pct(self) -> float:
        """E = S - D, relative to D [%]."""
        return deviation_pct(self.model_hz, self.rig_hz)

    @property
    def validation_uncertainty_pct(self) -> float | None:
        """Root sum of squares of the parts; None where the data state no uncertainty of their own [%]."""
        if self.rig_ci95_hz is None or not self.uncertainty_parts_pct:
            return None
        return math.sqrt(sum(part**2 for part in self.uncertainty_parts_pct.values()))

    @property
    def verdict(self) -> ComparisonVerdict:
        """Whether the error stands out of the uncertainty."""
        uncertainty = self.validation_uncertainty_pct
        if uncertainty is None:
            return ComparisonVerdict.INSUFFICIENT
        resolved = abs(self.comparison_error_pct) > uncertainty
        return ComparisonVerdict.RESOLVED if resolved else ComparisonVerdict.NOT_RESOLVED

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        names = (
            "model_deviation_pct", "rig_deviation_pct", "comparison_error_pct", "validation_uncertainty_pct",
        )  # fmt: skip
        computed = {name: getattr(self, name) for name in names}
        recomputed = {
            f"{who}_recomputed_pct": None if hz is None else deviation_pct(hz, self.kinematic_hz)
            for who, hz in (("paper_model", self.paper_model_hz), ("paper_rig", self.paper_rig_hz))
        }
        plain = dataclasses.asdict(self) | {"rig_source": self.rig_source.value}
        return plain | computed | recomputed | {"verdict": self.verdict.value}


def deviation_pct(value: float, reference: float) -> float:
    """Deviation of `value` from `reference` [%]."""
    return 100 * (value / reference - 1)
