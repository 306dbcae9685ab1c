"""Where the peaks of Figures 12 and 13 lie: every harmonic and sideband, model beside rig, in Hz and orders."""

from __future__ import annotations

from srbval.bearing import Fault
from srbval.report.content.names import BADGE
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.analyse import Analysis
from srbval.validation.lines import Line


def peaks_table(number: str, state: Fault, model: Analysis, rig: Analysis) -> Table:
    """One row a line of the state's family; a dash where it was not detected."""
    name = state.line or ""
    rows = [_row(line, model, rig) for line in model.lines if line.name.startswith(name)]
    return Table(
        id=f"peaks-{number}",
        label=f"Peaks of Figure {number}",
        caption=f"{name}, its harmonics and its sidebands at the shaft speed (fr), {state.label} defect: "
        "frequency found with its 95 % half width, shaft order, and power over the local noise.",
        columns=(
            Column(title="Line"),
            Column(title="Kinematic", unit="order", format=".4f"),
            Column(title="Model", unit="Hz", format=".3f"),
            Column(title="Model", unit="order", format=".4f"),
            Column(title="Model, over noise", format=",.0f"),
            Column(title="Rig", unit="Hz", format=".3f"),
            Column(title="Rig", unit="order", format=".4f"),
            Column(title="Rig, over noise", format=",.0f"),
        ),
        rows=rows,
        notes=("A dash: not told from noise, or out of the record's reach.",),
    )


def _row(line: Line, model: Analysis, rig: Analysis) -> list[Cell | Value]:
    name = line.name if line.harmonic == 1 else f"{line.harmonic}x{line.name}"
    return [name, line.kinematic_hz / model.speed.value_hz, *_found(line, model), *_found(line, rig)]


def _found(wanted: Line, analysis: Analysis) -> list[Cell | Value]:
    try:
        line = analysis.line(wanted.name, wanted.harmonic)
    except KeyError:
        return [None, None, None]
    if not line.detected or line.found_hz is None:
        return [None, None, line.snr]
    badge = BADGE[analysis.recording.origin] if wanted.harmonic == 1 else None
    return [
        Cell(value=line.found_hz, ci95=line.ci95_hz, badge=badge),
        line.found_hz / analysis.speed.value_hz,
        line.snr,
    ]
