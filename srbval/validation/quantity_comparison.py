"""Comparison error and validation uncertainty of every quantity of a recording, with what dominates it.

After ASME V&V 20 (2009): E = S - D; U joins numerics, inputs and data as a root of squares. Amplitudes are not
compared: neither the sensor's path nor the contact's damping is modelled.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from srbval.bearing import DEFECTS, Fault
from srbval.validation import spectrum_shape
from srbval.validation.analyse import Analysis
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.effects import Effect, Sensitivity, ShapeEffect, shape_of
from srbval.validation.quantities import Quantity, quantities

DATA_PARTS = ("rig reading", "rig speed")
MODEL_READING = "model reading"


class Kind(enum.StrEnum):
    """Kinds of quantities: one bias and one scatter each."""

    FREQUENCY = "line frequency"
    PATTERN = "harmonic pattern"
    PRESENCE = "sideband presence"
    SIDEBANDS = "sideband level"
    SHAPE = "spectrum shape"


@dataclass(frozen=True, kw_only=True)
class QuantityComparison:
    """One row: model and rig in `unit`, `error` and the 95 % `parts` of its uncertainty in `error_unit`.

    `*_present` says whether the line stands out of the noise on either side: where it does not on one, its level is
    the noise's and nothing is compared. `told` overrules the verdict of a quantity that is yes or no.
    """

    kind: Kind
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
    told: ComparisonVerdict | None = None

    @property
    def uncertainty(self) -> float | None:
        """Validation uncertainty; None where no term of numerics or inputs is known."""
        known = set(self.parts) - {MODEL_READING, *DATA_PARTS}
        return math.hypot(*self.parts.values()) if known else None

    @property
    def data_ci95(self) -> float:
        """The data's own share of it."""
        return math.hypot(*(self.parts.get(part, 0.0) for part in DATA_PARTS))

    @property
    def dominant(self) -> str:
        """The largest part; empty where there are none."""
        return max(self.parts, key=lambda name: self.parts[name], default="")

    @property
    def verdict(self) -> ComparisonVerdict:
        """What error and uncertainty allow to be said."""
        if self.told is not None:
            return self.told
        uncertainty = self.uncertainty
        if uncertainty is None or not (self.model_present and self.rig_present):
            return ComparisonVerdict.INSUFFICIENT
        resolved = abs(self.error) > uncertainty
        return ComparisonVerdict.RESOLVED if resolved else ComparisonVerdict.NOT_RESOLVED

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        computed = {"uncertainty": self.uncertainty, "dominant": self.dominant, "verdict": self.verdict.value}
        return dataclasses.asdict(self) | computed | {"told": self.told and self.told.value}


def compare(
    state: Fault, rig: Analysis, model: Analysis, known: Sensitivity, *, model_order: float | None = None
) -> tuple[QuantityComparison, ...]:
    """Every quantity of `state`'s fault that both sides can show.

    `model_order` is the model's line in orders of the shaft where the run tells it without a reading (from its cage's
    or its roller's speed). What numerics and inputs do, `known` from runs at one speed and load, is carried over.
    """
    if state not in DEFECTS:
        return ()
    theirs = {q.name: q for q in quantities(model, state)}
    line = state.line or ""
    if model_order is not None:
        theirs[line] = Quantity(name=line, unit="order", value=model_order, ci95=0.0, present=True)
    speed = 100 * rig.speed.ci95_hz / rig.speed.value_hz
    rows = []
    for own in quantities(rig, state):
        if own.name in theirs:
            rows += _rows(state, theirs[own.name], own, known.effects, speed)
    return (*rows, *_shape(state, rig, model, known.shapes))


def _rows(
    state: Fault, model: Quantity, rig: Quantity, effects: Sequence[Effect], speed_pct: float
) -> list[QuantityComparison]:
    sidebands = "sidebands" in rig.name
    kind = Kind.FREQUENCY if rig.unit == "order" else Kind.SIDEBANDS if sidebands else Kind.PATTERN
    level = _row(kind, state, model, rig, effects, speed_pct)
    return [_presence(level, model, rig), level] if sidebands else [level]


def _row(
    kind: Kind, state: Fault, model: Quantity, rig: Quantity, effects: Sequence[Effect], speed_pct: float
) -> QuantityComparison:
    relative = kind is Kind.FREQUENCY
    scale = 100 / rig.value if relative else 1.0
    parts = {MODEL_READING: scale * model.ci95, "rig reading": scale * rig.ci95}
    if relative:
        parts["rig speed"] = speed_pct
    own = [e for e in effects if (e.defect, e.quantity) == (state.value, rig.name)]
    parts |= {f"{e.kind}: {e.term}": scale * e.bound for e in own}
    return QuantityComparison(
        kind=kind,
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


def _presence(level: QuantityComparison, model: Quantity, rig: Quantity) -> QuantityComparison:
    """Yes or no on either side. A difference counts where the side without would have shown the other's level."""
    sides = (model, rig)
    missing = [quiet for quiet, other in (sides, sides[::-1]) if other.present and not quiet.present]
    if not missing:
        told = ComparisonVerdict.NOT_RESOLVED
    else:
        shown = max(q.value - q.ci95 for q in sides if q.present)
        told = ComparisonVerdict.RESOLVED if missing[0].least < shown else ComparisonVerdict.INSUFFICIENT
    return dataclasses.replace(
        level,
        kind=Kind.PRESENCE,
        quantity=f"{level.quantity}: shown",
        unit="1: yes",
        error_unit="yes or no",
        model=float(model.present),
        rig=float(rig.present),
        error=float(model.present) - float(rig.present),
        parts={},
        told=told,
    )


def _shape(
    state: Fault, rig: Analysis, model: Analysis, effects: Sequence[ShapeEffect]
) -> tuple[QuantityComparison, ...]:
    """The model's angle with the record beside that of the record's halves with each other, which is the best there is.

    The effect of a term is what it does to the model's angle with this very record.
    """
    own, theirs = shape_of(rig, state), shape_of(model, state)
    if own is None or theirs is None or not rig.line_of(state).detected:
        return ()
    within, between = spectrum_shape.angle_within(own), spectrum_shape.angle_between(own, theirs)
    parts = {MODEL_READING: between.ci95, "rig reading": within.ci95}
    for effect in effects:
        if effect.defect == state.value:
            name = f"{effect.kind}: {effect.term}"
            parts[name] = max(effect.bound_beside(own), parts.get(name, 0.0))
    return (
        QuantityComparison(
            kind=Kind.SHAPE,
            defect=state.value,
            quantity=spectrum_shape.NAME,
            unit=spectrum_shape.UNIT,
            error_unit=spectrum_shape.UNIT,
            model=between.degrees,
            rig=within.degrees,
            model_present=True,
            rig_present=within.related,
            error=between.degrees - within.degrees,
            parts=parts,
        ),
    )
