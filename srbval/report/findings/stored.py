"""The calibration of the model hierarchy as the report shows it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from srbval.models.ladder import RUNGS
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.table import summary


@dataclass(frozen=True, kw_only=True)
class ShownLadder:
    """The calibration table that comes with the program: what was run, on which rungs (name, title), and its summary.

    `rows` are those of `plan.table.summary`.
    """

    scenes: int
    seconds: float
    reference: str
    processor: str | None
    rungs: tuple[tuple[str, str], ...]
    rows: tuple[Mapping[str, Any], ...]


def shown_ladder(base: str = "paper") -> ShownLadder:
    """The shipped calibration about a bundled scene in the form the report shows."""
    table = shipped_calibration(base)
    return ShownLadder(
        scenes=len(table.entries),
        seconds=table.seconds,
        reference=table.reference,
        processor=table.machine.get("processor"),
        rungs=tuple((rung.name, rung.title) for rung in RUNGS if rung.name in table.models),
        rows=tuple(summary(table)),
    )
