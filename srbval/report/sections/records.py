"""Which records the report is made of, in which bands they are read, and the validation matrix of all of the rig."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.bias import LEAST_RECORDS
from srbval.comparison.compared_quantities import COMPARED, PRESENCE, ComparedQuantity
from srbval.comparison.comparison import Comparison, ComparisonVerdict
from srbval.comparison.counterpart import CONVERGED_POINTS, LONGEST_S, START_SHARE, STARTS, TURNS
from srbval.comparison.effects import QuantityEffects
from srbval.comparison.matrix import Matrix, MatrixCell
from srbval.report.blocks import Block, Figure, Listing, Section, Tone
from srbval.report.figures.comparison import agreement_plot
from srbval.report.figures.images import kurtogram_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordKurtogram
from srbval.report.section_texts import Texts, badge_of, side_of

TEXTS, BANDS, MATRIX = Texts("records"), Texts("bands"), Texts("matrix")
MOST_NAMED = 20  # files in a list; report.json has all
NAMED_LINES = ("BPFO", "BPFI", "2xBSF")  # of races and rollers
TOP_HZ = 10_240.0  # of kurtograms: both sides to the rig's Nyquist frequency
SHOWN_BY = {
    (True, True): "both",
    (True, False): "the model only",
    (False, True): "the rig only",
    (False, False): "neither",
}


def records_section(findings: Findings) -> Section:
    """One row per record."""
    return TEXTS.section(
        TEXTS.paragraph("kinds", runs=len(findings.runs)),
        *_problems(findings),
        TEXTS.table("records", _rows(findings)),
        appendix=(TEXTS.paragraph("chain"), TEXTS.table("lines-found", _rows(findings))),
    )


def _problems(findings: Findings) -> Iterator[Block]:
    """What of the registered data is not used, and what is used with a caution; nothing where all is well."""
    if findings.data["register_unreadable"]:
        yield TEXTS.callout("unreadable", tone=Tone.WARNING, why=findings.data["register_unreadable"])
    for name, rows in (("not-used", findings.data["recordings_not_used"]), ("cautions", findings.data["cautions"])):
        if rows:
            yield TEXTS.callout(name, tone=Tone.WARNING, count=len(rows), files=len({row["file"] for row in rows}))
            shown = (TEXTS.text(f"{name}-row", row=row) for row in rows[:MOST_NAMED])
            more = (TEXTS.text("more", more=len(rows) - MOST_NAMED),) if len(rows) > MOST_NAMED else ()
            yield Listing((*shown, *more))


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    groups = {"paper's speed": "paper", "at the rig's speed": "model", "rig side": "rig"}
    for group, analysis in ((name, one) for name, side in groups.items() for one in findings.analyses[side].values()):
        recording, shown = analysis.recording, analysis.processed
        low, high = shown.band_hz
        lines = [line for line in analysis.lines if line.detected and line.harmonic == 1 and line.name in NAMED_LINES]
        yield {
            "name": Path(recording.file).name if recording.file else "model run",
            "badge": badge_of(analysis),
            "group": group,
            "state": recording.state.label if recording.state else "not stated",
            "speed": analysis.speed,
            "seconds": recording.seconds,
            "band": f"{low:g} to {high:g}, {shown.band_filter.value}{', tracked' if shown.tracking.used else ''}",
            "lines": "; ".join(
                f"{line.name} {line.found_hz:.2f} Hz ({line.deviation_pct:+.2f} %)"
                for line in sorted(lines, key=lambda line: -(line.snr or 0))
            )
            or "no race or roller line",
        }


def band_section(findings: Findings) -> Section:
    """Kurtograms with the bands used."""
    panels = [_kurtogram(letter, shown) for letter, shown in zip("abcd", findings.kurtograms, strict=True)]
    chains = {"model_chain": findings.analyses["paper"][Fault.OUTER].processed.chain,
              "rig_chain": findings.analyses["rig"][Fault.OUTER].processed.chain}  # fmt: skip
    return BANDS.section(appendix=(BANDS.paragraph("intro", **chains), BANDS.grid("grid", panels, "Kurtograms")))


def _kurtogram(letter: str, shown: RecordKurtogram) -> Figure:
    analysis = shown.analysis
    state = Fault(analysis.recording.state or Fault.HEALTHY)
    plot = kurtogram_panel(shown, letter=letter, title=state.label, top_hz=TOP_HZ)
    return BANDS.figure(
        "kurtogram", plot, id=f"kurtogram-{letter}", badge=badge_of(analysis), letter=letter, side=side_of(analysis),
        state=state, band_hz=analysis.processed.band_hz, picture=shown.kurtogram,
    )  # fmt: skip


def matrix_section(findings: Findings) -> Section:
    """Tables and how to read them."""
    matrix = findings.matrix
    blocks: list[Block] = [
        MATRIX.paragraph("intro", matrix=matrix),
        MATRIX.table(
            "matrix-table", matrix.cells, remarks=[c for c in matrix.cells if c.remark], point=_point, call=_call
        ),
        MATRIX.paragraph("reading"),
        *(_bias_blocks(findings) if shown_rows(matrix) else ()),
    ]
    if matrix.unusable:
        blocks.append(Listing(MATRIX.each("unusable", [(Path(file).name, why) for file, why in matrix.unusable])))
    return MATRIX.section(appendix=blocks)


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
    yield MATRIX.table("matrix-quantities", compared, kinds=COMPARED, point=_point, entry=_entry)
    yield MATRIX.paragraph(
        "carried", turns=TURNS, seconds=LONGEST_S, starts=STARTS, share=START_SHARE, points=CONVERGED_POINTS
    )
    if findings.known.defects:
        rows = [row for defect in findings.known.defects for row in defect.quantities]
        yield MATRIX.table("inputs", rows, most_by=_most_by)
    yield MATRIX.table("bias", findings.data["bias"], shown_by=shown_by, least_records=LEAST_RECORDS)
    yield MATRIX.grid("grid-agreement", _agreement(shown), "Predicted against measured")


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
            yield MATRIX.figure("agreement", plot, id=f"agreement-{name}", label=label, points=len(own))


def shown_rows(matrix: Matrix) -> list[Comparison]:
    """Rows that both sides show, and all that count whether they do."""
    return [row for row in matrix.comparisons if row.both_present or row.kind == PRESENCE.kind]
