"""Table 6 at the paper's speed and at the recordings' own; speed or slip."""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.report.blocks import Badge, Section, Table, Tone
from srbval.report.findings.findings import Findings
from srbval.report.pages import first_line
from srbval.report.prose import Prose

TEXTS = Prose("srbval.report", "texts/table6.md")
SPEED = Prose("srbval.report", "texts/speed_or_slip.md")
LISTED = 4  # most measured records whose lines are listed one by one
VERDICT_TONE = {"differs": Tone.WARNING, "agrees": Tone.GOOD, "met": Tone.GOOD, "missed": Tone.BAD}  # else neutral


def table6_section(findings: Findings) -> Section:
    """Both tables and how to read them."""
    rows = findings.frame("table6")
    rows["name"] = [f"{Fault(defect).code} ({line})" for defect, line in zip(rows["defect"], rows["line"], strict=True)]
    return TEXTS.section(
        first_line(findings.results, "inputs"),
        _at_paper(rows[rows["rig_source"] == "published"], findings),
        _at_rig(rows[rows["rig_source"] == "measured"], findings),
        TEXTS.paragraph("how-to-read"),
    )


def _at_paper(rows: Any, findings: Findings) -> Table:
    own = [findings.analyses["paper"][Fault(row["defect"])].line(row["line"]) for _, row in rows.iterrows()]
    shown = rows.assign(kinematic_hz_badge=Badge.PUBLISHED, model_hz_ci95=rows["model_ci95_hz"])
    for name, badge, deviation in (
        ("paper_model_hz", Badge.PUBLISHED, "paper_model_recomputed_pct"),
        ("paper_rig_hz", Badge.PUBLISHED, "paper_rig_recomputed_pct"),
        ("model_hz", Badge.SIMULATED, "model_deviation_pct"),
    ):
        shown[f"{name}_badge"], shown[f"{name}_note"] = badge, rows[deviation].map("{:+.2f} %".format)
    computed = " and ".join(f"{line.name} {line.kinematic_hz:.2f} Hz" for line in own)
    return TEXTS.table("table-6-paper-speed", shown, shaft_rpm=findings.printed[Fault.OUTER].rpm, computed=computed)


def _at_rig(rows: Any, findings: Findings) -> Table:
    shown = rows.assign(
        kinematic_hz_badge=Badge.COMPUTED,
        rig_hz_badge=Badge.MEASURED,
        rig_hz_ci95=rows["rig_ci95_hz"],
        model_cage_hz=rows["model_hz"],
        model_cage_hz_badge=Badge.SIMULATED,
        verdict_tone=[VERDICT_TONE.get(verdict, Tone.NEUTRAL) for verdict in rows["verdict"]],
    )
    nominal_rpm = findings.analyses["rig"][Fault.OUTER].recording.nominal_rpm
    return TEXTS.table("table-6-rig-speed", shown, nominal_rpm=nominal_rpm)


def speed_or_slip_section(findings: Findings) -> Section:
    """BPFO + BPFI against the number of rollers, and what follows for the paper's slippage."""
    inner, rollers = findings.printed[Fault.INNER], findings.bearing.rolling_elements
    sums = findings.frame("closure")
    shown = sums.assign(
        source_badge=sums["origin"],
        total_ci95=sums["ci95"],
        closed=["no uncertainty stated" if closed is None else bool(closed) for closed in sums["closed"]],
    )
    slip_difference = sums.loc[sums["origin"] == "simulated", "slip_difference"].iloc[0]
    rig = sums[sums["source"] == "paper's rig"].iloc[0]
    measured = sums[sums["origin"] == "measured"].to_dict("records")
    words = {name: rig[name] for name in ("difference_pct", "implied_rpm")} | {"printed_pct": inner.rig_printed_pct}
    words["inner_rpm"] = inner.rpm * rig["bpfi_order"] / sums["bpfi_order"].iloc[0]  # over the printed kinematic one
    words["measured"] = measured_sentence(measured, findings.data["line_deviations"])
    return SPEED.section(
        SPEED.paragraph("intro", rollers=rollers),
        SPEED.table(
            "sum-rule-table",
            shown,
            rollers=rollers,
            more_notes=[SPEED.text("slip-difference", slip_difference=slip_difference)],
        ),
        SPEED.callout("statement", tone=Tone.NEUTRAL, **words),
    )


def measured_sentence(sums: Sequence[Mapping[str, Any]], lines: Sequence[Mapping[str, Any]]) -> str:
    """Sentence on the rig's recordings: their sum, and how far their lines are from kinematics."""
    own = [row for row in lines if row["speed_source"] == "tachometer"]
    parts = [SPEED.text("measured-sum", total=row["total"], ci95=row["ci95"]) for row in sums[:1]]
    if 0 < len(own) <= LISTED:
        listed = ", ".join(f"{row['line']} {row['slip_pct']:+.2f} ± {row['slip_ci95_pct']:.2f} %" for row in own)
        parts.append(SPEED.text("measured-lines", lines=listed))
    elif own:
        slips = [row["slip_pct"] for row in own]
        parts.append(SPEED.text("measured-range", least=min(slips), most=max(slips), count=len(own)))
    text = "; ".join(parts)
    return f" {text[0].upper()}{text[1:]}." if text else ""
