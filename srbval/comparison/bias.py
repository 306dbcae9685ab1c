"""One bias of each kind of quantity, with the interval that the number of records allows, and the model's scatter.

The record is the unit: errors of one record share its bearing, mounting and speed. Mean error and Student's interval
b +- t s / sqrt(n); below `LEAST_RECORDS` there is no claim, since neither mean nor scatter says anything of the next
record. What the errors scatter by beyond the data's own uncertainty is the model's (after the NIST fire-model
validation guide, McGrattan et al., NIST SP 1018-3).
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from srbval.comparison.compared_quantities import KINDS, Kind
from srbval.comparison.comparison import Comparison, deviation_pct
from srbval.comparison.matrix import MatrixCell
from srbval.signal import NORMAL_95

KIND = {kind.name: kind for kind in KINDS}
LEAST_RECORDS = 5


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One compared number of a record: model and rig, error and the data's 95 % half width in `unit`.

    Frequencies are deviations from kinematics.
    """

    kind: str
    record: str
    name: str
    model: float
    rig: float
    error: float
    data_ci95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Bias:
    """Bias of one kind, its 95 % half width, and scatter (one standard deviation, net of the data's).

    All three are None below `LEAST_RECORDS`: no claim; `mean_error`, over records, is only what was seen.
    """

    kind: str
    scene: str
    used_for: str
    unit: str
    records: int
    pairs: int
    mean_error: float
    bias: float | None
    ci95: float | None
    scatter: float | None
    data_scatter: float


def pairs(cells: Iterable[MatrixCell]) -> tuple[Pair, ...]:
    """Every comparison of every cell that both sides can show; whether sidebands show is compared wherever read."""
    return tuple(
        Pair(
            kind=kind.name,
            record=cell.file,
            name=f"{cell.state} {cell.nominal_rpm:g} rpm, {cell.radial_kn:g}/{cell.axial_kn:g} kN: {row.quantity}",
            model=_shown(kind, row.model.value, row.rig.kinematic),
            rig=_shown(kind, row.rig.value, row.rig.kinematic),
            error=row.error,
            data_ci95=row.data_ci95,
            unit=row.error_unit,
        )
        for cell in cells
        for row in cell.comparisons
        if (kind := KIND[row.kind]).yes_or_no or row.both_present
    )


def _shown(kind: Kind, value: float, kinematic: float | None) -> float:
    """The value itself; of a frequency its deviation from kinematics [%]."""
    return deviation_pct(value, kinematic) if kind.relative and kinematic else value


def biases(found: Sequence[Pair]) -> tuple[Bias, ...]:
    """One row per kind that has pairs and is measured, not counted."""
    measured = [name for name, kind in KIND.items() if not kind.yes_or_no]
    return tuple(bias_of(kind, own) for kind in measured if (own := [p for p in found if p.kind == kind]))


def biases_of(rows: Iterable[Comparison]) -> tuple[Bias, ...]:
    """One row per kind, scene and use of the comparisons that both sides show."""
    groups: dict[tuple[str, str, str], list[Pair]] = {}
    for row in rows:
        pair = Pair(
            kind=row.kind, record=row.record, name=row.quantity, model=row.model.value, rig=row.rig.value,
            error=row.error, data_ci95=row.data_ci95, unit=row.error_unit,
        )  # fmt: skip
        if row.both_present:
            groups.setdefault((row.kind, row.scene, row.used_for), []).append(pair)
    return tuple(bias_of(kind, own, scene, used_for) for (kind, scene, used_for), own in groups.items())


def bias_of(kind: str, own: Sequence[Pair], scene: str = "paper", used_for: str = "withheld") -> Bias:
    """Bias and scatter of the pairs of one kind."""
    from scipy.special import stdtrit

    errors = [
        statistics.fmean(pair.error for pair in own if pair.record == record)
        for record in dict.fromkeys(pair.record for pair in own)
    ]
    data = math.sqrt(statistics.fmean((pair.data_ci95 / NORMAL_95) ** 2 for pair in own))
    count = len(errors)
    row = Bias(
        kind=kind, scene=scene, used_for=used_for, unit=own[0].unit, records=count, pairs=len(own),
        mean_error=statistics.fmean(errors), bias=None, ci95=None, scatter=None, data_scatter=data
    )  # fmt: skip
    if count < LEAST_RECORDS:
        return row
    variance = statistics.variance(errors)
    return replace(
        row,
        bias=statistics.fmean(errors),
        ci95=float(stdtrit(count - 1, 0.975)) * math.sqrt(variance / count),
        scatter=math.sqrt(max(variance - data**2, 0.0)),
    )
