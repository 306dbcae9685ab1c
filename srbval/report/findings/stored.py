"""The stored results that the report shows, and what follows from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from srbval.comparison.effects import Sensitivity, sensitivity_of
from srbval.models.ladder import RUNGS
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.table import summary
from srbval.storage.stored_result import (
    AMPLITUDES,
    CAMPAIGN_SCALE,
    COMMAND,
    DIAGNOSIS,
    HELD_OUT,
    NOISE_STUDY,
    OWN_VERDICTS,
    PREDICTIONS,
    READING,
    RECORD_VERDICTS,
    RIG_BANDS,
    RIG_INPUTS,
    RIG_SPEED_ACCURACY,
    RIG_STABILITY,
    SENSITIVITY,
    SPEED_ACCURACY,
    STABILITY,
    VERDICT_SCAN,
    WATERFALL,
    StoredResult,
    newest_result,
)

KINDS = (
    SPEED_ACCURACY, STABILITY, NOISE_STUDY, CAMPAIGN_SCALE, READING, SENSITIVITY, HELD_OUT, RIG_INPUTS, RIG_BANDS,
    RIG_SPEED_ACCURACY, RIG_STABILITY, OWN_VERDICTS, RECORD_VERDICTS, DIAGNOSIS, AMPLITUDES, VERDICT_SCAN,
    WATERFALL, PREDICTIONS,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ShownResult:
    """The newest stored result of a kind, where there is one: its content and its origin; `command` makes one."""

    kind: str
    command: str
    content: Mapping[str, Any] | None
    origin: Mapping[str, Any] | None


@dataclass(frozen=True, kw_only=True)
class ShownLadder:
    """The calibration table that comes with the program: what was run, on which rungs (name, title), and its summary.

    `rows` are those of `bench.ladder.summary`.
    """

    scenes: int
    seconds: float
    reference: str
    processor: str | None
    rungs: tuple[tuple[str, str], ...]
    rows: tuple[Mapping[str, Any], ...]


def shown_results() -> dict[str, ShownResult]:
    """The newest stored result of every kind."""
    return {kind: shown_result(kind, newest_result(kind)) for kind in KINDS}


def shown_result(kind: str, found: StoredResult | None) -> ShownResult:
    """A stored result of `kind`, or that there is none, in the form the report shows."""
    return ShownResult(
        kind=kind,
        command=COMMAND[kind],
        content=None if found is None else found.content,
        origin=None if found is None else found.origin,
    )


def known_sensitivity(results: Mapping[str, ShownResult]) -> Sensitivity:
    """What numerics and inputs do to the compared quantities, as last measured; empty where it never was."""
    return sensitivity_of(results[SENSITIVITY].content or {})


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
