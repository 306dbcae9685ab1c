"""One bias and one scatter per kind of quantity, over all comparisons there are, net of the data's own scatter.

After the practice of the NIST fire-model validation guide (McGrattan et al., NIST SP 1018-3): the mean error is the
model's bias; what the errors scatter by beyond the data's own uncertainty is the model's.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from srbval.signal import NORMAL_95
from srbval.validation.comparison import deviation_pct
from srbval.validation.matrix import Cell
from srbval.validation.quantity_comparison import Kind, QuantityComparison

LEVELS = (Kind.PATTERN, Kind.SIDEBANDS)


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One compared number: model and rig, error and the data's 95 % half width in `unit`.

    Line frequencies are deviations from kinematics at the record's own speed.
    """

    kind: Kind
    name: str
    model: float
    rig: float
    error: float
    data_ci95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Bias:
    """Bias and scatter (one standard deviation, net of the data's) of one kind; scatter None below three pairs."""

    kind: Kind
    unit: str
    pairs: int
    bias: float
    scatter: float | None
    data_scatter: float


def pairs(cells: Iterable[Cell]) -> tuple[Pair, ...]:
    """Every comparison of every cell that both sides can show; whether sidebands show is compared wherever read."""
    return tuple(
        Pair(
            kind=row.kind,
            name=f"{cell.state} {cell.nominal_rpm:g} rpm, {cell.radial_kn:g}/{cell.axial_kn:g} kN: {row.quantity}",
            model=_shown(row, row.model, cell),
            rig=_shown(row, row.rig, cell),
            error=row.error,
            data_ci95=row.data_ci95,
            unit=row.error_unit,
        )
        for cell in cells
        for row in cell.comparisons
        if _counts(row)
    )


def _shown(row: QuantityComparison, value: float, cell: Cell) -> float:
    """The value itself; of a line's order its deviation from kinematics [%]."""
    return deviation_pct(value * cell.shaft_rpm / 60, cell.kinematic_hz) if row.kind is Kind.FREQUENCY else value


def _counts(row: QuantityComparison) -> bool:
    return row.kind is Kind.PRESENCE or (row.model_present and row.rig_present)


def biases(found: Sequence[Pair]) -> tuple[Bias, ...]:
    """One row a kind that has pairs."""
    return tuple(_bias(kind, own) for kind in Kind if (own := [p for p in found if p.kind is kind]))


def _bias(kind: Kind, own: Sequence[Pair]) -> Bias:
    errors = [pair.error for pair in own]
    data = math.sqrt(statistics.fmean((pair.data_ci95 / NORMAL_95) ** 2 for pair in own))
    scatter = math.sqrt(max(statistics.variance(errors) - data**2, 0.0)) if len(errors) > 2 else None
    return Bias(
        kind=kind, unit=own[0].unit, pairs=len(own), bias=statistics.fmean(errors), scatter=scatter, data_scatter=data
    )
