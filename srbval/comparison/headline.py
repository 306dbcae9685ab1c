"""What the table of comparisons says in short: the report's answer in one value, and one bias of each kind of quantity.

The answer is how far the model's cage ratio is from the rig's, how sure, and on what it rests. A record's answer is
that of its whole interval (`Tolerance.answer`), unless the scan of one input alone gives another: then, whatever the
interval says, the question is not resolved. The tolerance is missed where one record surely misses it, met where all
surely meet it.

Of a bias the record is the unit: errors of one record share its bearing, mounting and speed. Mean error and Student's
interval b +- t s / sqrt(n); below `LEAST_RECORDS` there is no claim, since neither mean nor scatter says anything of
the next record. What the errors scatter by beyond the data's own uncertainty is the model's (after the NIST fire-model
validation guide, McGrattan et al., NIST SP 1018-3).
"""

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from srbval.bearing import Fault
from srbval.comparison.budget import TOLERANCE, Answer, Tolerance
from srbval.comparison.compared_quantities import CAGE_RATIO, COMPARED, PRESENCE
from srbval.comparison.comparison import Comparison, deviation_pct
from srbval.signal import NORMAL_95

LEAST_RECORDS = 5


@dataclass(frozen=True, kw_only=True)
class RecordError:
    """The model's error of the cage ratio against one record [%], with the 95 % half width of that error.

    `scene` is the one that the model ran. In a stored scan one input at a time takes values over its range:
    `scanned_pct` are the least and the largest error found. `changed_by` names the inputs at some value of which the
    answer (met, missed, not resolved) is another than at the nominal one; `sign_changed_by` those among them with
    which both met and missed occur.
    """

    JSON_PROPERTIES: ClassVar = ("answer",)

    record: str
    state: Fault
    scene: str
    error_pct: float
    uncertainty_pct: float | None
    scanned_pct: tuple[float, float] | None = None
    changed_by: tuple[str, ...] = ()
    sign_changed_by: tuple[str, ...] = ()

    @property
    def answer(self) -> Answer:
        """What may be stated."""
        return Answer.NOT_RESOLVED if self.changed_by else TOLERANCE.answer(self.error_pct, self.uncertainty_pct)


@dataclass(frozen=True, kw_only=True)
class Headline:
    """The errors of the paper's scene and of the scene ``rig`` against measured records, held to the tolerance."""

    JSON_PROPERTIES: ClassVar = ("answer", "holds")

    quantity: str
    tolerance: Tolerance
    errors: tuple[RecordError, ...]
    rig_scene: tuple[RecordError, ...]

    @property
    def answer(self) -> Answer:
        """Of the paper's scene; without a record nothing is resolved."""
        answers = {one.answer for one in self.errors}
        if Answer.MISSED in answers:
            return Answer.MISSED
        return Answer.MET if answers == {Answer.MET} else Answer.NOT_RESOLVED

    @property
    def holds(self) -> bool:
        """Whether no tolerance is surely missed, which is not to say that it is met."""
        return self.answer is not Answer.MISSED


def headline(
    comparisons: Iterable[Comparison], rig_study: Mapping[str, Any] | None, scanned: Mapping[str, Any] | None
) -> Headline:
    """From the records' comparisons, the stored study of the scene ``rig`` and the stored scan, where there are any.

    A record's scan is that of its state and scene. The study states its uncertainty in per cent of the line: of the
    cage ratio c that is (1 - c) / c times as much by the line of the inner race.
    """
    rows = (scanned or {}).get("rows", ())
    studied = []
    for one in (rig_study or {}).get("studies", ()):
        if one["uncertainty_pct"] is not None:
            state, ratio = Fault(one["of"]["kind"]), one["of"]["cage_ratio"]
            per_line = 1.0 if state is Fault.OUTER else (1 - ratio) / ratio
            error_pct, u_pct = deviation_pct(one["nominal"], ratio), per_line * one["uncertainty_pct"]
            studied.append(_record_error(rows, one["of"]["record"], state, "rig", error_pct, u_pct))
    return Headline(
        quantity=CAGE_RATIO.name,
        tolerance=TOLERANCE,
        errors=tuple(
            _record_error(rows, Path(row.record).name, row.state, row.scene, row.error, row.uncertainty)
            for row in comparisons
            if row.kind == CAGE_RATIO.kind
        ),
        rig_scene=tuple(studied),
    )


def _record_error(
    scan: Sequence[Mapping[str, Any]], record: str, state: Fault, scene: str, error_pct: float, u_pct: float | None
) -> RecordError:
    made = RecordError(record=record, state=state, scene=scene, error_pct=error_pct, uncertainty_pct=u_pct)
    own = [row for row in scan if (row["defect"], row["scene"]) == (state.value, scene)]
    if not own:
        return made
    nominal = next(row["answers"][0] for row in own if not row["name"])
    errors = [error for row in own for error in row["errors_pct"]]
    turned = {row["name"]: {*row["answers"], nominal} for row in own if set(row["answers"]) != {nominal}}
    return replace(
        made, scanned_pct=(min(errors), max(errors)), changed_by=tuple(turned),
        sign_changed_by=tuple(name for name, answers in turned.items() if {Answer.MET, Answer.MISSED} <= answers),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Bias:
    """Bias of the comparisons of one kind, scene and use; its 95 % half width; scatter (one sd, net of the data's).

    These three are None below `LEAST_RECORDS`: no claim; `mean_error`, over records, is only what was seen.
    `data_scatter` is one standard deviation of the data.
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


def biases(rows: Iterable[Comparison], *, used_for: str = "") -> tuple[Bias, ...]:
    """One for each kind, scene and use of the rows that both sides show; yes or no is counted, not measured.

    With `used_for` rows of every use count together, under that name.
    """
    groups: dict[tuple[str, str, str], list[Comparison]] = {}
    for row in rows:
        if row.both_present and row.kind != PRESENCE.kind:
            groups.setdefault((row.kind, row.scene, used_for or row.used_for), []).append(row)
    places = {row.kind: place for place, row in enumerate(COMPARED)}
    return tuple(_bias(*key, groups[key]) for key in sorted(groups, key=lambda key: places.get(key[0], len(places))))


def _bias(kind: str, scene: str, used_for: str, rows: Sequence[Comparison]) -> Bias:
    from scipy.special import stdtrit

    by_record: dict[str, list[float]] = {}
    for row in rows:
        by_record.setdefault(row.record, []).append(row.error)
    errors = [statistics.fmean(own) for own in by_record.values()]
    count, mean = len(errors), statistics.fmean(errors)
    data = math.sqrt(statistics.fmean((row.data_ci95 / NORMAL_95) ** 2 for row in rows))
    claimed = count >= LEAST_RECORDS
    variance = statistics.variance(errors) if claimed else 0.0
    return Bias(
        kind=kind, scene=scene, used_for=used_for, unit=rows[0].error_unit, records=count, pairs=len(rows),
        mean_error=mean, bias=mean if claimed else None,
        ci95=float(stdtrit(count - 1, 0.975)) * math.sqrt(variance / count) if claimed else None,
        scatter=math.sqrt(max(variance - data**2, 0.0)) if claimed else None, data_scatter=data,
    )  # fmt: skip
