"""The validation matrix: every registered record of the rig, as maps over Table 5 and as a table."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbval.evidence.gather import Evidence
from srbval.report.badges import Badge, Tone
from srbval.report.blocks import Block, Callout, Figure, FigureGrid, Listing, Paragraph
from srbval.report.content.names import FETCH_COMMAND
from srbval.report.content.quantity_blocks import bias_blocks
from srbval.report.figures.matrix import HeatMap, heat_map
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.fault_call import Basis
from srbval.validation.matrix import Matrix, MatrixCell

DEVIATION_LIMIT_PCT = 0.5
SNR_LIMITS = (0.0, 3.0)  # powers of ten
VERDICT_LEVEL = {
    ComparisonVerdict.NOT_RESOLVED.value: 1.0,
    ComparisonVerdict.RESOLVED.value: -1.0,
    ComparisonVerdict.INSUFFICIENT.value: 0.0,
}


def matrix_section(evidence: Evidence, folder: Path) -> Section:
    """Maps, table and reading; only a remark where no record of the rig is registered."""
    matrix = evidence.matrix
    blocks: list[Block] = [_intro(matrix)]
    if matrix.cells:
        blocks += [_maps(matrix, folder), _table(matrix), _reading(), *bias_blocks(matrix.cells, folder)]
    else:
        text = f"No record of the rig is registered: all {matrix.size} cells are empty. `{FETCH_COMMAND}` fills some."
        blocks.append(Callout(tone=Tone.WARNING, title="Empty", text=text))
    if matrix.unusable:
        blocks.append(Listing(items=tuple(literal(f"{Path(file).name}: {why}") for file, why in matrix.unusable)))
    return Section(id="matrix", title="Validation matrix: all registered records of the rig", blocks=tuple(blocks))


def _intro(matrix: Matrix) -> Paragraph:
    return Paragraph(
        f"The paper's Table 5 spans {matrix.size} operating points: {len(matrix.grid.states)} states, "
        f"{len(matrix.grid.radial_kn)} load cases, {len(matrix.grid.nominal_rpm)} motor speeds. **{len(matrix.cells)} "
        f"of them have a registered record**; the others are left empty, never filled. Every record goes through the "
        "one pipeline, at its own measured speed; the model runs beside it at that speed and load."
    )


def _maps(matrix: Matrix, folder: Path) -> FigureGrid:
    drawn = (
        ("deviation", "Deviation of the rig's line from kinematics at the measured speed",
         "Deviation, %", (-DEVIATION_LIMIT_PCT, DEVIATION_LIMIT_PCT), "RdBu_r",
         lambda c: c.line.detected_deviation_pct, _deviation_text),
        ("detectability", "Detectability: the first harmonic's power over the local noise (n.d.: below detection)",
         "Line over noise, powers of ten", SNR_LIMITS, "Blues",
         lambda c: math.log10(max(c.line.snr or 0.0, 1.0)), _snr_text),
        ("verdict", "Model minus rig, %: green agrees within U, pink is resolved (dot: baseline or no model line)",
         "", (-1.6, 1.6), "PiYG",
         lambda c: VERDICT_LEVEL.get(c.verdict), _verdict_text),
    )  # fmt: skip
    return FigureGrid(
        label="Validation matrix",
        caption="States and load cases (radial/axial kN) down, nominal motor speeds across; blank: no record. "
        "H is the healthy bearing, whose BPFO line is its baseline, not a fault.",
        columns=1,
        figures=tuple(_map(matrix, folder, *entry) for entry in drawn),
    )


def _map(
    matrix: Matrix,
    folder: Path,
    kind: str,
    caption: str,
    label: str,
    limits: tuple[float, float],
    colours: str,
    value: Callable[[MatrixCell], float | None],
    text: Callable[[MatrixCell], str],
) -> Figure:
    grid = matrix.grid
    loads = list(zip(grid.radial_kn, grid.axial_kn, strict=True))
    rows = [(state, *load) for state in grid.states for load in loads]
    cells = [[matrix.at((*row, rpm)) for rpm in grid.nominal_rpm] for row in rows]
    numbers = [[math.nan if c is None or (v := value(c)) is None else v for c in line] for line in cells]
    files = heat_map(
        folder,
        f"matrix-{kind}",
        shown=HeatMap(
            values=np.array(numbers, dtype=np.float64),
            texts=[["" if c is None else text(c) for c in line] for line in cells],
            label=label,
            limits=limits,
            colours=colours,
        ),
        rows=[f"{state.code}  {radial:g}/{axial:g}" for state, radial, axial in rows],
        columns=[f"{rpm:g}" for rpm in grid.nominal_rpm],
        groups=len(loads),
    )
    said = "; ".join(
        f"{c.state.code} {c.radial_kn:g}/{c.axial_kn:g} kN {c.nominal_rpm:g} rpm: {text(c)}"
        for c in matrix.cells
    )
    return Figure(id=f"matrix-{kind}", caption=caption, file=files.picture, data=files.data, badge=Badge.MEASURED,
                  alt=f"Map of {matrix.size} operating points, {len(matrix.cells)} filled. {said}.")  # fmt: skip


def _verdict_text(cell: MatrixCell) -> str:
    return "n.d." if not cell.line.detected else "·" if cell.error_pct is None else f"{cell.error_pct:+.2f}"


def _snr_text(cell: MatrixCell) -> str:
    return f"{cell.line.snr or 0:.0f}" if cell.line.detected else "n.d."


def _deviation_text(cell: MatrixCell) -> str:
    return "n.d." if cell.line.detected_deviation_pct is None else f"{cell.line.detected_deviation_pct:+.2f}"


def _table(matrix: Matrix) -> Table:
    return Table(
        id="matrix-table",
        label="Validation matrix",
        caption="Every registered record of the rig. Deviation: rig from kinematics; error: model minus rig, with the "
        "uncertainty of that comparison.",
        columns=(
            Column(title="State, loads kN, motor rpm"),
            Column(title="Shaft", unit="rpm", format=".2f"),
            Column(title="Line"),
            Column(title="Rig", unit="Hz", format=".3f"),
            Column(title="Over noise", format=".0f"),
            Column(title="Deviation", unit="%", format="+.3f"),
            Column(title="Error", unit="%", format="+.3f"),
            Column(title="Verdict on the model"),
            Column(title="Fault call"),
        ),
        rows=[_row(c) for c in matrix.cells],
        notes=_remarks(matrix),
    )  # fmt: skip


def _remarks(matrix: Matrix) -> tuple[str, ...]:
    return tuple(
        f"{c.state.code} {c.nominal_rpm:g} rpm, no model line: {literal(c.remark)}"
        for c in matrix.cells
        if c.remark
    )


def _row(c: MatrixCell) -> list[Cell | Value]:
    return [
        _name(c),
        Cell(value=c.shaft_rpm, ci95=60 * c.speed.ci95_hz, note=c.speed.source.value),
        c.line.name,
        Cell(value=c.line.found_hz, ci95=c.line.ci95_hz, badge=Badge.MEASURED) if c.line.detected else None,
        c.line.snr,
        Cell(
            value=c.line.detected_deviation_pct, ci95=c.line.deviation_ci95_pct if c.line.detected else None
        ),
        Cell(value=c.error_pct, ci95=c.uncertainty_pct),
        c.verdict,
        _call(c),
    ]


def _name(c: MatrixCell) -> str:
    return f"{c.state.code}, {c.radial_kn:g}/{c.axial_kn:g}, {c.nominal_rpm:g}"


def _call(c: MatrixCell) -> str:
    if c.call.basis is Basis.DECLARED_HEALTHY:
        return "none: baseline"
    if c.call.basis is Basis.LINE_ALONE:
        return "a line alone cannot tell"
    if c.call.called is None:
        return "none: no line has risen"
    low, high = c.call.ratio_ci95 or (math.nan, math.nan)
    state = c.call.called.code
    return f"{state}: {c.call.line} {c.call.ratio:.3g} times the healthy (95 %: {low:.3g} to {high:.3g})"


def _reading() -> Paragraph:
    return Paragraph(
        "**Healthy is a baseline, not silence**: rollers passing under load give the healthy bearing a BPFO line of "
        "its own. A fault is called only where a line stands twice as high as in the healthy record of the same speed "
        "and load, its 95 % interval clear of one; without such a record a line alone cannot tell. A roller's line is "
        "looked for in the model about the roller's own turning, which its three contact circles decide."
    )
