"""The report's answer in one value: how far the model's cage ratio is from the rig's, how sure, and on what it rests.

A record's answer is that of its whole interval (`Tolerance.answer`), unless the scan of one input alone gives another:
then, whatever the interval says, the question is not resolved. The tolerance is missed where one record surely misses
it, met where all surely meet it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from srbval.bearing import Fault
from srbval.comparison.budget import TOLERANCE, Answer, Tolerance
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import Comparison, deviation_pct


@dataclass(frozen=True, kw_only=True)
class RecordError:
    """The model's error of the cage ratio against one record [%], with the 95 % half width of that error.

    `scene` is the one that the model ran. A stored scan takes each input alone over its range: `scanned_pct` are the
    least and the largest error found, `turned_by` names the inputs that by themselves change the answer that the
    nominal inputs give, `reversed_by` those of them that make a met tolerance a missed one or the other way round.
    """

    JSON_PROPERTIES: ClassVar = ("answer",)

    record: str
    state: Fault
    scene: str
    error_pct: float
    uncertainty_pct: float | None
    scanned_pct: tuple[float, float] | None = None
    turned_by: tuple[str, ...] = ()
    reversed_by: tuple[str, ...] = ()

    @property
    def answer(self) -> Answer:
        """What may be stated."""
        return Answer.NOT_RESOLVED if self.turned_by else TOLERANCE.answer(self.error_pct, self.uncertainty_pct)


@dataclass(frozen=True, kw_only=True)
class Headline:
    """The errors of the paper's scene and of the scene ``rig`` against measured records, held to the tolerance."""

    JSON_PROPERTIES: ClassVar = ("answer", "holds", "within_pct")

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

    @property
    def within_pct(self) -> float | None:
        """What no record's error exceeds, with its interval; None without records or intervals."""
        known = [abs(one.error_pct) + one.uncertainty_pct for one in self.errors if one.uncertainty_pct is not None]
        return max(known) if known and len(known) == len(self.errors) else None


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
        made, scanned_pct=(min(errors), max(errors)), turned_by=tuple(turned),
        reversed_by=tuple(name for name, answers in turned.items() if {Answer.MET, Answer.MISSED} <= answers),
    )  # fmt: skip
