"""One bias for each kind of compared quantity: mean error over records, its interval, and the model's scatter.

The record is the unit: errors of one record share its bearing, mounting and speed. Mean error and Student's interval
b +- t s / sqrt(n); below `LEAST_RECORDS` there is no claim, since neither mean nor scatter says anything of the next
record. What the errors scatter by beyond the data's own uncertainty is the model's (after the NIST fire-model
validation guide, McGrattan et al., NIST SP 1018-3).
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from typing import Any

from srbval.comparison.compared_quantities import COMPARED, PRESENCE
from srbval.comparison.comparison import Comparison
from srbval.signal import NORMAL_95

LEAST_RECORDS = 5
Row = dict[str, Any]  # a bias as it is stored


def biases(rows: Iterable[Comparison], *, used_for: str = "") -> tuple[Row, ...]:
    """One for each kind, scene and use of the rows that both sides show; yes or no is counted, not measured.

    With `used_for` rows of every use count together, under that name. `bias`, its 95 % half width and the `scatter`,
    one standard deviation net of the data's, are None below `LEAST_RECORDS`; `mean_error` is what was seen.
    """
    groups: dict[tuple[str, str, str], list[Comparison]] = {}
    for row in rows:
        if row.both_present and row.kind != PRESENCE.kind:
            groups.setdefault((row.kind, row.scene, used_for or row.used_for), []).append(row)
    places = {row.kind: place for place, row in enumerate(COMPARED)}
    return tuple(_bias(*key, groups[key]) for key in sorted(groups, key=lambda key: places.get(key[0], len(places))))


def _bias(kind: str, scene: str, used_for: str, rows: Sequence[Comparison]) -> Row:
    from scipy.special import stdtrit

    by_record: dict[str, list[float]] = {}
    for row in rows:
        by_record.setdefault(row.record, []).append(row.error)
    errors = [statistics.fmean(own) for own in by_record.values()]
    count, mean = len(errors), statistics.fmean(errors)
    data = math.sqrt(statistics.fmean((row.data_ci95 / NORMAL_95) ** 2 for row in rows))
    claimed = count >= LEAST_RECORDS
    variance = statistics.variance(errors) if claimed else 0.0
    return {
        "kind": kind, "scene": scene, "used_for": used_for, "unit": rows[0].error_unit, "records": count,
        "pairs": len(rows), "mean_error": mean, "bias": mean if claimed else None,
        "ci95": float(stdtrit(count - 1, 0.975)) * math.sqrt(variance / count) if claimed else None,
        "scatter": math.sqrt(max(variance - data**2, 0.0)) if claimed else None, "data_scatter": data,
    }  # fmt: skip
