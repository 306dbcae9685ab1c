"""Lines, harmonic pattern and sidebands of the rig's recordings beside the model's, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from srbval.report.badges import Tone
from srbval.report.blocks import Block, Figure, FigureGrid, Paragraph
from srbval.report.figures.agreement import agreement_plot
from srbval.report.table import Cell, Column, Table
from srbval.validation.bias import Pair, biases, pairs
from srbval.validation.compared_quantities import KINDS, PRESENCE, Kind
from srbval.validation.comparison import Comparison, ComparisonVerdict
from srbval.validation.counterpart import TURNS
from srbval.validation.matrix import MatrixCell
from srbval.validation.sensitivity import NOMINAL_RPM

TONE = {
    ComparisonVerdict.RESOLVED: Tone.WARNING,
    ComparisonVerdict.NOT_RESOLVED: Tone.GOOD,
    ComparisonVerdict.INSUFFICIENT: Tone.NEUTRAL,
}


def quantity_blocks(rows: Sequence[Comparison]) -> tuple[Block, ...]:
    """Nothing without rows."""
    return (_table(rows), _remark()) if rows else ()


def _table(rows: Sequence[Comparison]) -> Table:
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
                row.fault.code,
                row.quantity,
                row.model.value,
                row.rig.value,
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


def bias_blocks(cells: Sequence[MatrixCell], folder: Path) -> tuple[Block, ...]:
    """Every fault cell's quantities, bias and scatter over them, predicted against measured; nothing without any."""
    found = pairs(cells)
    return (_cells_table(cells), _carried(), _bias_table(found), _agreement(found, folder)) if found else ()


def _cells_table(cells: Sequence[MatrixCell]) -> Table:
    compared = [cell for cell in cells if cell.comparisons]
    return Table(
        id="matrix-quantities",
        label="Every quantity of every fault",
        caption="Model minus rig, one row a record of a fault whose line shows; brackets: U. "
        "Harmonics: levels over the first, mean of those both sides show. Shape: angle between the model's and rig's "
        "log spectra, less that between the record's own halves (0: as like as the record to itself).",
        columns=(
            Column(title="State, loads kN, motor rpm"),
            Column(title="Line"),
            *(Column(title=kind.heading) for kind in KINDS),
        ),
        rows=[
            [
                f"{c.state.code}, {c.radial_kn:g}/{c.axial_kn:g}, {c.nominal_rpm:g}",
                c.line.name,
                *(_entry(c, kind) for kind in KINDS),
            ]
            for c in compared
        ],
        notes=("Amplitude: not validated, as in the paper.",),
    )


def _entry(cell: MatrixCell, kind: Kind) -> str:
    rows = [row for row in cell.comparisons if row.kind == kind.name]
    if kind.yes_or_no:
        texts = (f"{_yes(row.model.value)} / {_yes(row.rig.value)}, {row.verdict.value}" for row in rows)
        return "; ".join(texts) or "none expected"
    shown = [row for row in rows if row.both_present]
    if not shown:
        return "not on both sides" if rows else ""
    if len(shown) == 1:
        return _error(shown[0])
    mean = sum(row.error for row in shown) / len(shown)
    resolved = sum(row.verdict is ComparisonVerdict.RESOLVED for row in shown)
    return f"{mean:+.2g} ({resolved} of {len(shown)} resolved)"


def _yes(value: float) -> str:
    return "yes" if value else "no"


def _error(row: Comparison) -> str:
    if row.uncertainty is None:
        return f"{row.error:+.2g}"
    resolved = ", resolved" if row.verdict is ComparisonVerdict.RESOLVED else ""
    return f"{row.error:+.2g} [{row.uncertainty:.2g}]{resolved}"


def _carried() -> Paragraph:
    return Paragraph(
        f"**What U takes over**: numerics and inputs were varied at {NOMINAL_RPM:g} rpm and 124.8 kN only "
        "(`srbval bench --sensitivity`); their effects are carried over to every other point, the data's own share "
        f"is each record's. The model runs {TURNS:g} turns of the shaft beside each record."
    )


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
        notes=(
            "Amplitude: not validated, as in the paper. "
            + _presence(found)
            + "Spectrum shape: the model's angle with a record less "
            "that of the record's halves with each other; what noise does to any model is in both.",
        ),
    )


def _presence(found: Sequence[Pair]) -> str:
    """Sidebands shown by both, one or none, in words: a plot of yes and no says no more."""
    sides = [(bool(p.model), bool(p.rig)) for p in found if p.kind == PRESENCE.name]
    names = {
        (True, True): "both",
        (True, False): "the model only",
        (False, True): "the rig only",
        (False, False): "neither",
    }
    told = ", ".join(f"{sides.count(key)} by {name}" for key, name in names.items() if key in sides)
    return f"Sideband presence, 1 for shown and 0 for not: sidebands are shown {told}. " if told else ""


def _agreement(found: Sequence[Pair], folder: Path) -> FigureGrid:
    figures = []
    for name, label in dict.fromkeys((kind.plot, kind.axis) for kind in KINDS if kind.plot):
        kinds = {kind.name for kind in KINDS if kind.plot == name}
        own = [p for p in found if p.kind in kinds]
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
