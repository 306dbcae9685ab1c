"""Predictions of the planner against scenes that nothing was tuned on: the stored result of the test."""

from __future__ import annotations

from typing import Any

from srbval.report.blocks import Block, Paragraph
from srbval.report.content.kept_result import missing, origin_of
from srbval.report.table import Column, Table
from srbval.storage.stored_result import HELD_OUT, newest_result


def held_out_blocks() -> tuple[Block, ...]:
    """What it says in words, its origin, a row a question; a note in their place where there is none."""
    kept = newest_result(HELD_OUT)
    if kept is None:
        return (missing(HELD_OUT),)
    rows = kept.content["tallies"]
    return (
        Paragraph(
            "**Predictions held against fresh scenes.** Speed, load and bump height drawn at random within the "
            "calibrated range, for each defect and roller fit; the planner's figures were fixed before they were run. "
            "A prediction is a bound: the largest error at the calibration scenes about the drawn one, times a margin "
            f"read from other drawn scenes. {_in_words(rows[-1])}"
        ),
        origin_of(kept),
        _table(rows, kept.content["seconds"]),
    )


def _in_words(total: dict[str, Any]) -> str:
    broken = total["broken"]
    kept = "none was" if not broken else f"{broken} {'was' if broken == 1 else 'were'}"
    return (
        f"{total['within']} of {total['predictions']} measured errors lie within their bound, {total['within_twice']} "
        f"within twice it; of {total['promises']} times that a rung was called enough at a tolerance, {kept} broken."
    )


def _table(rows: list[dict[str, Any]], seconds: float) -> Table:
    return Table(
        id="held-out-table",
        label="Held-out scenes",
        caption=f"Measured against predicted errors on drawn scenes of {seconds:g} s, all rungs with a prediction.",
        columns=(
            Column(title="Question"),
            Column(title="Scenes", format="d"),
            Column(title="All rungs within twice", unit="scenes", format="d"),
            Column(title="Predictions", format="d"),
            Column(title="Within", format="d"),
            Column(title="Within twice", format="d"),
            Column(title="No answer", format="d"),
            Column(title="Called enough", unit="times", format="d"),
            Column(title="Broken", unit="times", format="d"),
        ),
        rows=[
            [
                row["title"], row["scenes"], row["scenes_within_twice"], row["predictions"], row["within"],
                row["within_twice"], row["unanswered"], row["promises"], row["broken"],
            ]
            for row in rows
        ],
        notes=(
            "**Called enough**: each rung of each scene is asked at tolerances from 0.1 to 200 %. **Broken**: its "
            "measured error was above the tolerance then, or it had no answer.",
        ),
    )  # fmt: skip
