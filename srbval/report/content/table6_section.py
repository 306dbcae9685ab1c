"""Table 6 with uncertainties: at the paper's speed, and at the rig recordings' own."""

from __future__ import annotations

from srbval.bearing import Fault
from srbval.evidence.gather import Evidence
from srbval.report.badges import Badge, Tone
from srbval.report.blocks import Block, Callout, Figure, Paragraph
from srbval.report.content.names import FETCH_COMMAND
from srbval.report.content.quantity_blocks import quantity_blocks
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.comparison import ComparisonVerdict, deviation_pct
from srbval.validation.table6 import PrintedRow, RigSource, Table6Row

TONE = {
    ComparisonVerdict.RESOLVED: Tone.WARNING,
    ComparisonVerdict.NOT_RESOLVED: Tone.GOOD,
    ComparisonVerdict.INSUFFICIENT: Tone.NEUTRAL,
}


def table6_section(evidence: Evidence, picture: Figure) -> Section:
    """Both tables and how to read them."""
    published = [row for row in evidence.rows if row.rig_source is RigSource.PUBLISHED]
    measured = [row for row in evidence.rows if row.rig_source is RigSource.MEASURED]
    blocks: list[Block] = [_published_table(published, evidence.printed.shaft_rpm), picture]
    if measured:
        rpm = evidence.rig[Fault.OUTER].recording.nominal_rpm
        blocks += [_measured_table(measured, rpm or 0.0), _parts_table(measured), _how_to_read()]
        blocks += quantity_blocks(evidence.comparisons)
    else:
        blocks.append(
            Callout(
                tone=Tone.WARNING,
                title="No rig recording is registered",
                text="The model is held against published values only. Real recordings of this rig are open: "
                f"`{FETCH_COMMAND}` downloads and registers them.",
            )
        )
    return Section(id="table-6", title="Table 6: fault frequencies", blocks=tuple(blocks))


def _published_table(rows: list[Table6Row], shaft_rpm: float) -> Table:
    table: list[list[Cell | Value]] = [
        [
            f"{row.comparison.fault.code} ({row.line.name})",
            Cell(value=row.line.kinematic_hz, badge=Badge.PUBLISHED),
            _with_deviation(row.printed, "model"),
            _with_deviation(row.printed, "rig"),
            Cell(
                value=row.comparison.model.value,
                ci95=row.comparison.model.ci95,
                badge=Badge.SIMULATED,
                note=f"{row.model_deviation_pct:+.3f} %",
            ),
            row.model_cage_hz,
        ]
        for row in rows
    ]
    return Table(
        id="table-6-paper-speed",
        label="Table 6",
        caption=f"Fault frequencies at {shaft_rpm:g} rpm shaft speed: the paper's values and ours. Below each its "
        "deviation from the kinematic frequency, recomputed, with the paper's printed one in parentheses.",
        columns=(
            Column(title="Defect (line)"),
            Column(title="Kinematic, printed", unit="Hz", format=".2f"),
            Column(title="Paper's model", unit="Hz", format=".2f"),
            Column(title="Paper's rig", unit="Hz", format=".2f"),
            Column(title="Our model, read", unit="Hz", format=".3f"),
            Column(title="Our model, cage speed", unit="Hz", format=".3f"),
        ),
        rows=table,
        notes=(
            "**Read**: joint fit of the harmonics in the spectrum of the squared envelope, with its 95 % interval. "
            "**Cage speed**: "
            "the same line from the model's own mean cage speed, an independent check.",
            "The paper states neither an uncertainty nor a measured speed for its rig values, so no verdict can be "
            "given on them: **insufficient data**.",
        ),
    )


def _with_deviation(row: PrintedRow | None, side: str) -> Cell:
    """The paper's value for its model or its rig."""
    if row is None:
        return Cell(value=None)
    value, printed_pct = (
        (row.model_hz, row.model_printed_pct) if side == "model" else (row.rig_hz, row.rig_printed_pct)
    )
    recomputed = deviation_pct(value, row.kinematic_hz)
    return Cell(value=value, badge=Badge.PUBLISHED, note=f"{recomputed:+.3f} % (printed {printed_pct:+g} %)")


def _measured_table(rows: list[Table6Row], nominal_rpm: float) -> Table:
    table: list[list[Cell | Value]] = [
        [
            f"{row.comparison.fault.code} ({row.line.name})",
            row.shaft_rpm,
            Cell(value=row.line.kinematic_hz, badge=Badge.COMPUTED),
            Cell(value=row.comparison.rig.value, ci95=row.comparison.rig.ci95, badge=Badge.MEASURED),
            Cell(value=row.comparison.model.value, badge=Badge.SIMULATED),
            row.comparison.error,
            row.comparison.uncertainty,
            Cell(value=row.comparison.verdict.value, tone=TONE[row.comparison.verdict]),
        ]
        for row in rows
    ]
    return Table(
        id="table-6-rig-speed",
        label="Table 6 at the rig's own speed",
        caption=f"The model at each recording's tachometer speed ({nominal_rpm:g} rpm nominal) beside that recording.",
        columns=(
            Column(title="Defect (line)"),
            Column(title="Shaft, measured", unit="rpm", format=".2f"),
            Column(title="Kinematic", unit="Hz", format=".3f"),
            Column(title="Rig", unit="Hz", format=".3f"),
            Column(title="Our model, cage speed", unit="Hz", format=".3f"),
            Column(title="Error E", unit="%", format="+.3f"),
            Column(title="Uncertainty U", unit="%", format=".3f"),
            Column(title="Verdict"),
        ),
        rows=table,
    )


def _parts_table(rows: list[Table6Row]) -> Table:
    names = list(rows[0].comparison.parts)
    return Table(
        id="uncertainty-parts",
        label="What U is made of",
        caption="Parts of the validation uncertainty, 95 % half widths; U is the root of their sum of squares.",
        columns=(Column(title="Part"), *(Column(title=row.line.name, unit="%", format=".3f") for row in rows)),
        rows=[[name, *(row.comparison.parts[name] for row in rows)] for name in names],
        notes=(
            "Not included: the defects' shape (the rig's are drilled pits, the model's are raised points). "
            "`srbval bench --sensitivity` measures the terms of numerics and inputs.",
        ),
    )


def _how_to_read() -> Paragraph:
    return Paragraph(
        "The error E is model minus rig, relative to the rig. After ASME V&V 20 the model's error counts as "
        "**resolved** "
        "only where it exceeds U; **not resolved from uncertainty** means that what separates model and rig is no "
        "larger than what is not known."
    )
