"""One bias and one scatter per kind of quantity, over all comparisons there are, net of the data's own scatter.

After the practice of the NIST fire-model validation guide (McGrattan et al., NIST SP 1018-3): the mean error is the
model's bias; what the errors scatter by beyond the data's own uncertainty is the model's.
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from srbval.signal import NORMAL_95
from srbval.validation.compared_quantities import KINDS, Kind
from srbval.validation.comparison import deviation_pct
from srbval.validation.matrix import MatrixCell

KIND = {kind.name: kind for kind in KINDS}


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One compared number: model and rig, error and the data's 95 % half width in `unit`.

    Line frequencies are deviations from kinematics at the record's own speed.
    """

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


def pairs(cells: Iterable[MatrixCell]) -> tuple[Pair, ...]:
    """Every comparison of every cell that both sides can show; whether sidebands show is compared wherever read."""
    return tuple(
        Pair(
            kind=kind.name,
            name=f"{cell.state} {cell.nominal_rpm:g} rpm, {cell.radial_kn:g}/{cell.axial_kn:g} kN: {row.quantity}",
            model=_shown(kind, row.model.value, cell),
            rig=_shown(kind, row.rig.value, cell),
            error=row.error,
            data_ci95=row.data_ci95,
            unit=row.error_unit,
        )
        for cell in cells
        for row in cell.comparisons
        if (kind := KIND[row.kind]).yes_or_no or row.both_present
    )


def _shown(kind: Kind, value: float, cell: MatrixCell) -> float:
    """The value itself; of a line's order its deviation from kinematics [%]."""
    return deviation_pct(value * cell.shaft_rpm / 60, cell.line.kinematic_hz) if kind.relative else value


def biases(found: Sequence[Pair]) -> tuple[Bias, ...]:
    """One row per kind that has pairs."""
    return tuple(_bias(kind, own) for kind in KIND if (own := [p for p in found if p.kind == kind]))


def _bias(kind: str, own: Sequence[Pair]) -> Bias:
    errors = [pair.error for pair in own]
    data = math.sqrt(statistics.fmean((pair.data_ci95 / NORMAL_95) ** 2 for pair in own))
    scatter = math.sqrt(max(statistics.variance(errors) - data**2, 0.0)) if len(errors) > 2 else None
    return Bias(
        kind=kind, unit=own[0].unit, pairs=len(own), bias=statistics.fmean(errors), scatter=scatter, data_scatter=data
    )
