"""Lines, harmonic pattern and sidebands of the rig's recordings beside the model's, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

from srbval.recordings import State
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Paragraph
from srbval.report.content.names import STATE_CODE
from srbval.report.table import Cell, Column, Table
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.quantity_comparison import QuantityComparison

TONE = {
    ComparisonVerdict.RESOLVED: Tone.WARNING,
    ComparisonVerdict.NOT_RESOLVED: Tone.GOOD,
    ComparisonVerdict.INSUFFICIENT: Tone.NEUTRAL,
}


def quantity_blocks(rows: Sequence[QuantityComparison]) -> tuple[Block, ...]:
    """Nothing without rows."""
    return (_table(rows), _remark()) if rows else ()


def _table(rows: Sequence[QuantityComparison]) -> Table:
    return Table(
        id="quantities",
        label="Every quantity at the rig's speed",
        caption="Comparison error and validation uncertainty, 95 %. Orders are of the shaft; levels are of the squared "
        "envelope over its first harmonic.",
        columns=(
            Column(title="Defect"),
            Column(title="Quantity"),
            Column(title="Model", format=".4g"),
            Column(title="Rig", format=".4g"),
            Column(title="Unit"),
            Column(title="Error E", format="+.3g"),
            Column(title="Uncertainty U", format=".3g"),
            Column(title="Of E and U"),
            Column(title="Largest part of U"),
            Column(title="Verdict"),
        ),
        rows=[
            [
                STATE_CODE[State(row.defect)],
                row.quantity,
                row.model,
                row.rig,
                row.unit,
                row.error,
                row.uncertainty,
                row.error_unit,
                row.dominant,
                Cell(value=row.verdict.value, tone=TONE[row.verdict]),
            ]
            for row in rows
        ],
    )


def _remark() -> Paragraph:
    return Paragraph(
        "**Amplitude is not validated**, here as in the paper: neither the path from contact to sensor nor the damping "
        "of the contacts is known. A level is compared only where its line stands out of the noise on both sides."
    )
