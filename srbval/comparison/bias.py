"""One bias for each kind of compared quantity: mean error over records, its interval, and the model's scatter.

The record is the unit: errors of one record share its bearing, mounting and speed. Mean error and Student's interval
b +- t s / sqrt(n); with fewer than `LEAST_RECORDS` records no bias is claimed, since neither mean nor scatter predicts
the next record. The scatter of the errors beyond the data's own uncertainty is the model's (after the NIST fire-model
validation guide, McGrattan et al., NIST SP 1018-3).
"""

import math
from typing import TYPE_CHECKING

from srbval.comparison.compared_quantities import COMPARED
from srbval.comparison.comparison import Row
from srbval.signal import NORMAL_95

if TYPE_CHECKING:
    import pandas as pd

LEAST_RECORDS = 5


def biases(comparisons: "pd.DataFrame", *, used_for: str = "") -> list[Row]:
    """Bias of each kind, scene and use among the rows that both sides show.

    With `used_for` rows of every use count together, under that name. `bias`, its 95 % half width `ci95` and the
    `scatter`, one standard deviation net of the data's, are None below `LEAST_RECORDS`; `mean_error` is the mean seen.
    """
    both = comparisons["model_present"].astype(bool) & comparisons["rig_present"].astype(bool)
    shown = comparisons[both]
    if used_for:
        shown = shown.assign(used_for=used_for)
    places = {row.kind: place for place, row in enumerate(COMPARED)}
    groups = shown.groupby(["kind", "scene", "used_for"], sort=False)
    return [
        _bias(kind, scene, use, rows)
        for (kind, scene, use), rows in sorted(groups, key=lambda group: places.get(group[0][0], len(places)))
    ]


def _bias(kind: str, scene: str, used_for: str, rows: "pd.DataFrame") -> Row:
    from scipy.special import stdtrit

    errors = rows.groupby("record", sort=False)["error"].mean()
    count, mean = len(errors), float(errors.mean())
    data = math.sqrt(float((rows["data_ci95"] ** 2).mean())) / NORMAL_95
    claimed = count >= LEAST_RECORDS
    variance = float(errors.var()) if claimed else 0.0
    return {
        "kind": kind,
        "scene": scene,
        "used_for": used_for,
        "unit": rows["error_unit"].iloc[0],
        "records": count,
        "pairs": len(rows),
        "mean_error": mean,
        "bias": mean if claimed else None,
        "ci95": float(stdtrit(count - 1, 0.975)) * math.sqrt(variance / count) if claimed else None,
        "scatter": math.sqrt(max(variance - data**2, 0.0)) if claimed else None,
        "data_scatter": data,
    }
