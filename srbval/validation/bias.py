"""One bias and one scatter per kind of quantity, over all comparisons there are, net of the data's own scatter.

After the practice of the NIST fire-model validation guide (McGrattan et al., NIST SP 1018-3): the mean error is the
model's bias; what the errors scatter by beyond the data's own uncertainty is the model's.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from srbval.recordings import State
from srbval.validation.matrix import Cell
from srbval.validation.quantity_comparison import QuantityComparison

FREQUENCY, PATTERN, SIDEBANDS = "line frequency", "harmonic pattern", "sideband level"
NORMAL_95 = 1.96
FAULTS = (State.OUTER, State.INNER)
DATA_PARTS = ("rig reading", "rig speed")


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One compared number: model and rig, error and the data's 95 % half width in `unit`."""

    kind: str
    name: str
    model: float
    rig: float
    error: float
    data_ci95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Bias:
    """Bias and scatter (one standard deviation, net of the data's) of one kind; scatter None below three pairs."""

    kind: str
    unit: str
    pairs: int
    bias: float
    scatter: float | None
    data_scatter: float


def pairs(comparisons: Iterable[QuantityComparison], cells: Iterable[Cell]) -> tuple[Pair, ...]:
    """Line frequencies of the whole matrix (orders); levels of every comparison whose line both sides show.

    A healthy bearing's line is its baseline, not the fault that the model has: it is left out.
    """
    found = [
        Pair(
            kind=FREQUENCY,
            name=f"{cell.state} {cell.nominal_rpm:g} rpm, {cell.radial_kn:g} kN",
            model=60 * cell.model_hz / cell.shaft_rpm,
            rig=60 * cell.rig_hz / cell.shaft_rpm,
            error=cell.error_pct,
            data_ci95=cell.deviation_ci95_pct or 0.0,
            unit="%",
        )
        for cell in cells
        if cell.state in FAULTS and cell.error_pct is not None and cell.model_hz is not None and cell.rig_hz is not None
    ]
    for row in comparisons:
        if row.unit == "dB" and row.model_present and row.rig_present:
            found.append(
                Pair(
                    kind=SIDEBANDS if "sidebands" in row.quantity else PATTERN,
                    name=f"{row.defect} {row.quantity}",
                    model=row.model,
                    rig=row.rig,
                    error=row.error,
                    data_ci95=math.hypot(*(row.parts.get(part, 0.0) for part in DATA_PARTS)),
                    unit="dB",
                )
            )
    return tuple(found)


def biases(found: Sequence[Pair]) -> tuple[Bias, ...]:
    """One row a kind that has pairs."""
    return tuple(
        _bias(kind, own) for kind in (FREQUENCY, PATTERN, SIDEBANDS) if (own := [p for p in found if p.kind == kind])
    )


def _bias(kind: str, own: Sequence[Pair]) -> Bias:
    errors = [pair.error for pair in own]
    data = math.sqrt(statistics.fmean((pair.data_ci95 / NORMAL_95) ** 2 for pair in own))
    scatter = math.sqrt(max(statistics.variance(errors) - data**2, 0.0)) if len(errors) > 2 else None
    return Bias(
        kind=kind, unit=own[0].unit, pairs=len(own), bias=statistics.fmean(errors), scatter=scatter, data_scatter=data
    )
