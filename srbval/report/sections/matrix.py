"""The validation matrix: tables, bias and scatter of every registered record of the rig."""

import math
from collections.abc import Iterator
from pathlib import Path

from srbval.bearing import Fault
from srbval.comparison.bias import LEAST_RECORDS
from srbval.comparison.compared_quantities import COMPARED, PRESENCE, ComparedQuantity
from srbval.comparison.comparison import Comparison, ComparisonVerdict
from srbval.comparison.counterpart import CONVERGED_POINTS, LONGEST_S, START_SHARE, STARTS, TURNS
from srbval.comparison.effects import QuantityEffects
from srbval.comparison.matrix import Matrix, MatrixCell
from srbval.report.blocks import Block, Figure, Listing, Section
from srbval.report.figures.comparison import agreement_plot
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import Texts

TEXTS = Texts("matrix")
SHOWN_BY = {
    (True, True): "both",
    (True, False): "the model only",
    (False, True): "the rig only",
    (False, False): "neither",
}


def matrix_section(findings: Findings) -> Section:
    """Tables and how to read them."""
    matrix = findings.matrix
    blocks: list[Block] = [
        TEXTS.paragraph("intro", matrix=matrix),
        TEXTS.table(
            "matrix-table", matrix.cells, remarks=[c for c in matrix.cells if c.remark], point=_point, call=_call
        ),
        TEXTS.paragraph("reading"),
        *(_bias_blocks(findings) if shown_rows(matrix) else ()),
    ]
    if matrix.unusable:
        blocks.append(Listing(TEXTS.each("unusable", [(Path(file).name, why) for file, why in matrix.unusable])))
    return TEXTS.section(appendix=blocks)


def _point(cell: MatrixCell) -> str:
    return f"{cell.state.code}, {cell.radial_kn:g}/{cell.axial_kn:g}, {cell.nominal_rpm:g}"


def _call(cell: MatrixCell) -> str:
    """The fault call of a record in a few words."""
    call = cell.call
    if call.baseline is None:
        return "none: baseline" if cell.state is Fault.HEALTHY else "a line alone cannot tell"
    if call.risen is None:
        return "none: no line has risen"
    low, high = call.ratio_ci95 or (math.nan, math.nan)
    return f"{call.risen.code}: {call.line} {call.ratio:.3g} times the healthy (95 %: {low:.3g} to {high:.3g})"


def _bias_blocks(findings: Findings) -> Iterator[Block]:
    """Every fault cell's quantities, bias and scatter over them, predicted against measured."""
    compared = [cell for cell in findings.matrix.cells if cell.comparisons]
    shown = shown_rows(findings.matrix)
    sides = [(bool(row.model.value), bool(row.rig.value)) for row in shown if row.kind == PRESENCE.kind]
    shown_by = [(name, sides.count(key)) for key, name in SHOWN_BY.items() if key in sides]
    yield TEXTS.table("matrix-quantities", compared, kinds=COMPARED, point=_point, entry=_entry)
    yield TEXTS.paragraph(
        "carried", turns=TURNS, seconds=LONGEST_S, starts=STARTS, share=START_SHARE, points=CONVERGED_POINTS
    )
    if findings.known.defects:
        rows = [row for defect in findings.known.defects for row in defect.quantities]
        yield TEXTS.table("inputs", rows, most_by=_most_by)
    yield TEXTS.table("bias", findings.data["bias"], shown_by=shown_by, least_records=LEAST_RECORDS)
    yield TEXTS.grid("grid-agreement", _agreement(shown), "Predicted against measured")


def _entry(cell: MatrixCell, kind: ComparedQuantity) -> str:
    """What a cell's comparison of one kind says."""
    rows = [row for row in cell.comparisons if row.kind == kind.kind]
    if kind.yes_or_no:
        yes = {False: "no", True: "yes"}
        texts = (f"{yes[bool(x.model.value)]} / {yes[bool(x.rig.value)]}, {x.verdict.value}" for x in rows)
        return "; ".join(texts) or "none expected"
    return "; ".join(_error(row) for row in rows if row.both_present) or ("not on both sides" if rows else "")


def _error(row: Comparison) -> str:
    if row.uncertainty is None:
        return f"{row.error:+.2g}"
    p = "" if row.p is None else f", p {row.p:.2g}"
    return f"{row.error:+.2g} [{row.uncertainty:.2g}]{p}{', resolved' * (row.verdict is ComparisonVerdict.RESOLVED)}"


def _most_by(row: QuantityEffects) -> str:
    most = sorted(row.shares, key=lambda name: -row.shares[name])[:2]
    return ", ".join(f"{name} {100 * row.shares[name]:.0f} %" for name in most)


def _agreement(shown: list[Comparison]) -> Iterator[Figure]:
    for name, label in dict.fromkeys((kind.plot, kind.axis) for kind in COMPARED if kind.plot):
        kinds = {kind.kind for kind in COMPARED if kind.plot == name}
        own = [row for row in shown if row.kind in kinds]
        if own:
            plot = agreement_plot(own, label)
            yield TEXTS.figure("agreement", plot, id=f"agreement-{name}", label=label, points=len(own))


def shown_rows(matrix: Matrix) -> list[Comparison]:
    """Rows that both sides show, and all that count whether they do."""
    return [row for row in matrix.comparisons if row.both_present or row.kind == PRESENCE.kind]
