"""The report's answer in one value: how far the model's cage ratio is from the rig's, how sure, and on what it rests.

A record's answer is that of its whole interval (`Tolerance.answer`), unless the scan of one input alone gives another:
then, whatever the interval says, the question is not resolved. The tolerance is missed where one record surely misses
it, met where all surely meet it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from srbval.bearing import Fault
from srbval.comparison.budget import TOLERANCE, Answer, Tolerance
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import Comparison, deviation_pct


@dataclass(frozen=True, kw_only=True)
class RecordError:
    """Error of the cage ratio against one record with its 95 % half width [%], and what the scan makes of it.

    `scene` names the model's; `scanned_pct` are the least and the largest error of the scan, `turned_by` what in it
    would alone give another answer than all nominal does, and `reversed_by` what of that the opposite one.
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
    """From the records' comparisons, the stored study of the scene ``rig`` and the stored scan, either of them or not.

    A record's scan is that of its state and scene.
    """
    rows = (scanned or {}).get("rows", ())
    studies = [one for one in (rig_study or {}).get("studies", ()) if one["uncertainty_pct"] is not None]
    return Headline(
        quantity=CAGE_RATIO.name,
        tolerance=TOLERANCE,
        errors=tuple(
            RecordError(
                record=Path(row.record).name, state=row.fault, scene=row.scene, error_pct=row.error,
                uncertainty_pct=row.uncertainty, **_scanned(rows, row.fault, row.scene),
            )
            for row in comparisons if row.kind == CAGE_RATIO.name
        ),
        rig_scene=tuple(_of_study(one["of"], one, rows) for one in studies),
    )  # fmt: skip


def _of_study(of: Mapping[str, Any], study: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> RecordError:
    """The study states its uncertainty in per cent of the line: of the cage ratio it is (1 - c) / c times that."""
    state, ratio = Fault(of["kind"]), of["cage_ratio"]
    per_line = 1.0 if state is Fault.OUTER else (1 - ratio) / ratio
    return RecordError(
        record=of["record"], state=state, scene="rig", error_pct=deviation_pct(study["nominal"], ratio),
        uncertainty_pct=per_line * study["uncertainty_pct"], **_scanned(rows, state, "rig"),
    )  # fmt: skip


def _scanned(rows: Sequence[Mapping[str, Any]], state: Fault, scene: str) -> dict[str, Any]:
    own = [row for row in rows if (row["defect"], row["scene"]) == (state.value, scene)]
    if not own:
        return {}
    nominal = next(row["answers"][0] for row in own if not row["name"])
    errors = [error for row in own for error in row["errors_pct"]]
    turned = {row["name"]: {*row["answers"], nominal} for row in own if set(row["answers"]) != {nominal}}
    return {
        "scanned_pct": (min(errors), max(errors)),
        "turned_by": tuple(turned),
        "reversed_by": tuple(name for name, answers in turned.items() if {Answer.MET, Answer.MISSED} <= answers),
    }
