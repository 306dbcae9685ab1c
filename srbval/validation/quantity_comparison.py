"""Comparison error and validation uncertainty of every quantity of a recording, with what dominates it.

After ASME V&V 20 (2009): E = S - D; U joins numerics, inputs and data as a root of squares. Amplitudes are not
compared: neither the sensor's path nor the contact's damping is modelled.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from srbval.recordings import State
from srbval.validation.analyse import Analysis
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.quantities import LINE_OF, Quantity, quantities
from srbval.validation.sensitivity import Effect


@dataclass(frozen=True, kw_only=True)
class QuantityComparison:
    """One row: model and rig in `unit`, `error` and the 95 % `parts` of its uncertainty in `error_unit`.

    `*_present` says whether the line stands out of the noise on either side: where it does not on one, its level is
    the noise's and nothing is compared.
    """

    defect: str
    quantity: str
    unit: str
    error_unit: str
    model: float
    rig: float
    model_present: bool
    rig_present: bool
    error: float
    parts: Mapping[str, float]

    @property
    def uncertainty(self) -> float | None:
        """Validation uncertainty; None where no term of numerics or inputs is known."""
        known = set(self.parts) - {"model reading", "rig reading", "rig speed"}
        return math.hypot(*self.parts.values()) if known else None

    @property
    def dominant(self) -> str:
        """The largest part."""
        return max(self.parts, key=lambda name: self.parts[name])

    @property
    def verdict(self) -> ComparisonVerdict:
        """What error and uncertainty allow to be said."""
        uncertainty = self.uncertainty
        if uncertainty is None or not (self.model_present and self.rig_present):
            return ComparisonVerdict.INSUFFICIENT
        resolved = abs(self.error) > uncertainty
        return ComparisonVerdict.RESOLVED if resolved else ComparisonVerdict.NOT_RESOLVED

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        computed = {"uncertainty": self.uncertainty, "dominant": self.dominant, "verdict": self.verdict.value}
        return dataclasses.asdict(self) | computed


def compare(
    rig: Mapping[State, Analysis], beside: Mapping[State, Analysis], effects: Sequence[Effect]
) -> tuple[QuantityComparison, ...]:
    """Every quantity that both sides of a state can show, in the order of `LINE_OF`."""
    rows = []
    for state in LINE_OF:
        if state in rig:
            model = {q.name: q for q in quantities(beside[state], state)}
            speed = 100 * rig[state].speed.ci95_hz / rig[state].speed.value_hz
            rows += [
                _row(state, model[q.name], q, effects, speed) for q in quantities(rig[state], state) if q.name in model
            ]
    return tuple(rows)


def _row(
    state: State, model: Quantity, rig: Quantity, effects: Sequence[Effect], speed_pct: float
) -> QuantityComparison:
    relative = rig.unit == "order"
    scale = 100 / rig.value if relative else 1.0
    parts = {"model reading": scale * model.ci95, "rig reading": scale * rig.ci95}
    if relative:
        parts["rig speed"] = speed_pct
    own = [e for e in effects if (e.defect, e.quantity) == (state.value, rig.name)]
    parts |= {f"{e.kind}: {e.term}": scale * e.bound for e in own}
    return QuantityComparison(
        defect=state.value,
        quantity=rig.name,
        unit=rig.unit,
        error_unit="%" if relative else "dB",
        model=model.value,
        rig=rig.value,
        model_present=model.present,
        rig_present=rig.present,
        error=scale * (model.value - rig.value),
        parts=parts,
    )
