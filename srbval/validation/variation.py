"""What one change does to the cage speed, and so to the race lines."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.models.run import Run
from srbval.validation.cases import Case
from srbval.validation.comparison import deviation_pct
from srbval.validation.effects import Effect, Sensitivity


@dataclass(frozen=True, kw_only=True)
class Variation:
    """A varied run against the paper's: cage ratios and what the change does to each race line [%].

    Both follow from the mean cage speed: BPFO = Z f_c, BPFI = Z (f_r - f_c).
    """

    id: str
    purpose: str
    state: str
    cage_ratio: float
    bpfo_hz: float
    bpfi_hz: float
    bpfo_change_pct: float
    bpfi_change_pct: float
    roller_load_share: float


def variation(case: Case, run: Run, base: Run) -> Variation:
    """Compare a varied run with the run it was varied from."""
    return Variation(
        id=case.id,
        purpose=case.purpose,
        state=case.state.value,
        cage_ratio=run.cage_ratio,
        bpfo_hz=run.bpfo_hz,
        bpfi_hz=run.bpfi_hz,
        bpfo_change_pct=deviation_pct(run.bpfo_hz, base.bpfo_hz),
        bpfi_change_pct=deviation_pct(run.bpfi_hz, base.bpfi_hz),
        roller_load_share=run.roller_load_share,
    )


def as_sensitivity(variations: Iterable[Variation], base: Run) -> Sensitivity:
    """What the variations of the outer-race run tell of both race lines, where no study of all terms is stored."""
    shaft_hz = base.scene.shaft_hz
    return Sensitivity(
        effects=tuple(
            Effect(
                term=v.purpose.partition(": ")[2] or v.purpose,
                kind=v.purpose.partition(": ")[0],
                source="the report's own runs",
                defect=defect.value,
                quantity=defect.line or "",
                unit="order",
                base=base_hz / shaft_hz,
                bound=abs(pct) / 100 * base_hz / shaft_hz,
            )
            for v in variations
            if v.state == Fault.OUTER.value
            for defect, base_hz, pct in (
                (Fault.OUTER, base.bpfo_hz, v.bpfo_change_pct),
                (Fault.INNER, base.bpfi_hz, v.bpfi_change_pct),
            )
        )
    )
