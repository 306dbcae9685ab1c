"""The verdict, and Table 6 with uncertainties: at the paper's speed, and at the rig recordings' own."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.budget import Answer
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Figure
from srbval.report.figures.deviation import Deviation, deviation_plot
from srbval.report.findings.findings import Evidence
from srbval.report.model import Section, VerdictBox
from srbval.report.section_texts import Texts
from srbval.report.sections.names import FETCH_COMMAND, VERDICT_TONE
from srbval.storage.json_files import to_json

TEXTS, VERDICT = Texts("table6"), Texts("verdict")
ANSWER_TONE = {Answer.MET: Tone.GOOD, Answer.MISSED: Tone.BAD, Answer.NOT_RESOLVED: Tone.NEUTRAL}


def verdict_box(evidence: Evidence) -> VerdictBox:
    """The answer in plain words, first on the page: all from the comparisons; stand-ins take no part."""
    found = evidence.headline
    points = VERDICT.listing(
        "points",
        found=found,
        judged=[(cell.state, cell.verdict) for cell in evidence.matrix.cells if cell.judged],
        records=[evidence.rig[one.state] for one in found.errors],
        study=evidence.known.of(found.errors[0].state) if found.errors else None,
        fetch_command=FETCH_COMMAND,
    )
    return VerdictBox(
        tone=ANSWER_TONE[found.answer] if found.errors else Tone.WARNING,
        headline=VERDICT.text("headline", found=found),
        points=points.items,
    )


def table6_section(evidence: Evidence) -> Section:
    """Both tables and how to read them."""
    published, measured = (
        [row for row in evidence.rows if row["rig_source"] == source] for source in ("published", "measured")
    )
    blocks: list[Block] = [
        TEXTS.table(
            "table-6-paper-speed",
            map(to_json, published),
            shaft_rpm=evidence.printed.shaft_rpm,
            computed=[evidence.paper[row["defect"]].line(row["line"]) for row in published],
        ),
        _deviations(evidence),
    ]
    if not measured:
        blocks.append(TEXTS.callout("no-recording", tone=Tone.WARNING, fetch_command=FETCH_COMMAND))
        return TEXTS.section(*blocks)
    nominal_rpm = evidence.rig[Fault.OUTER].recording.nominal_rpm
    at_rig = TEXTS.table(
        "table-6-rig-speed", map(to_json, measured), nominal_rpm=nominal_rpm, verdict_tone=VERDICT_TONE
    )
    parts = TEXTS.table("uncertainty-parts", measured[0]["uncertainty_parts_pct"], compared=measured)
    quantities = TEXTS.table("quantities", map(to_json, evidence.comparisons), verdict_tone=VERDICT_TONE)
    return TEXTS.section(*blocks, at_rig, TEXTS.paragraph("how-to-read"), appendix=(parts, quantities))


def _deviations(evidence: Evidence) -> Figure:
    """Deviations from kinematics of every source in Table 6."""
    points = [point for row in evidence.rows for point in _points(row)]
    return TEXTS.figure("table6-deviations", partial(deviation_plot, points=points))


def _points(row: Mapping[str, Any]) -> list[Deviation]:
    """The sources of one row of Table 6, as `report.json` has it."""
    group = f"{Fault(row['defect']).code} at {row['shaft_rpm']:.0f} rpm"
    sources = [("our model", "simulated", row["model_deviation_pct"], row["model_ci95_hz"])]
    if row["rig_source"] == "measured":
        sources += [("rig, measured", "measured", row["rig_deviation_pct"], row["rig_ci95_hz"])]
    else:
        sources += [("paper's rig", "published", row["rig_deviation_pct"], None)]
        sources += [("paper's model", "published", row["paper_model_recomputed_pct"], None)]
    return [
        Deviation(
            group=group, source=source, kind=kind, deviation_pct=deviation,
            ci95_pct=100 * ci95 / row["kinematic_hz"] if ci95 else None,
        )
        for source, kind, deviation, ci95 in sources
    ]  # fmt: skip
