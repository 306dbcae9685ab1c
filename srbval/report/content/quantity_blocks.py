"""Lines, harmonic pattern and sidebands of the rig's recordings beside the model's, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from srbval.recordings import State
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Figure, FigureGrid, Paragraph
from srbval.report.content.names import STATE_CODE
from srbval.report.figures.agreement import agreement_plot
from srbval.report.table import Cell, Column, Table
from srbval.validation.bias import FREQUENCY, Pair, biases, pairs
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.evidence import Evidence
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


def bias_blocks(evidence: Evidence, folder: Path) -> tuple[Block, ...]:
    """Bias and scatter over every comparison, and predicted against measured; nothing without comparisons."""
    found = pairs(evidence.comparisons, evidence.matrix.cells)
    return (_bias_table(found), _agreement(found, folder)) if found else ()


def _bias_table(found: Sequence[Pair]) -> Table:
    return Table(
        id="bias",
        label="Bias and scatter",
        caption="Model minus rig over all comparisons there are: mean, and what scatters beyond the data's own "
        "uncertainty (one standard deviation; empty: fewer than three pairs).",
        columns=(
            Column(title="Quantity"),
            Column(title="Pairs", format="d"),
            Column(title="Unit"),
            Column(title="Bias", format="+.3g"),
            Column(title="Scatter, net", format=".3g"),
            Column(title="Scatter of the data", format=".3g"),
        ),
        rows=[[row.kind, row.pairs, row.unit, row.bias, row.scatter, row.data_scatter] for row in biases(found)],
        notes=("Amplitude: not validated, as in the paper.",),
    )


def _agreement(found: Sequence[Pair], folder: Path) -> FigureGrid:
    groups = {
        "order": ("orders of the shaft", [p for p in found if p.kind == FREQUENCY]),
        "level": ("level over the first harmonic, dB", [p for p in found if p.kind != FREQUENCY]),
    }
    figures = []
    for name, (label, own) in groups.items():
        if own:
            files = agreement_plot(folder, f"agreement-{name}", pairs=own, label=label)
            figures.append(
                Figure(
                    id=f"agreement-{name}", label="", file=files.picture, data=files.data, badge=None, caption=label,
                    alt=f"Predicted against measured {label}, {len(own)} points about the line of agreement.",
                )
            )  # fmt: skip
    return FigureGrid(
        figures=tuple(figures), label="Predicted against measured",
        caption="Every comparison of the registered records; on the line model and rig agree. Bars: the data's 95 %.",
    )  # fmt: skip
