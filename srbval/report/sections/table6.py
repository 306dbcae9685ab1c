"""The verdict; Table 6 with uncertainties, at the paper's speed and at the recordings' own; speed or slip."""

from collections.abc import Iterator, Mapping
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.budget import Answer
from srbval.report.blocks import Block, Section, Tone, VerdictBox
from srbval.report.figures.comparison import deviation_plot
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import VERDICT_TONE, Texts
from srbval.storage.json_files import to_json

TEXTS, VERDICT, SPEED = Texts("table6"), Texts("verdict"), Texts("speed_and_slip")
LISTED = 4  # so many measured records are named one by one
ANSWER_TONE = {Answer.MET: Tone.GOOD, Answer.MISSED: Tone.BAD, Answer.NOT_RESOLVED: Tone.NEUTRAL}


def verdict_box(findings: Findings) -> VerdictBox:
    """The answer in plain words, first on the page: all from the comparisons."""
    found = findings.headline
    answers = {one.verdict for one in found.stated}
    worst = next((a for a in (Answer.MISSED, Answer.NOT_RESOLVED, Answer.MET) if a in answers), None)
    return VERDICT.verdict(
        ANSWER_TONE[worst] if worst else Tone.WARNING,
        found=found,
        judged=[(cell.state, cell.nominal_rpm, cell.verdict) for cell in findings.matrix.cells if cell.judged],
        readings=findings.cage_readings,
    )


def table6_section(findings: Findings) -> Section:
    """Both tables and how to read them."""
    rows = findings.data["table6"]
    published, measured = ([row for row in rows if row["rig_source"] == source] for source in ("published", "measured"))
    computed = [findings.analyses["paper"][row["defect"]].line(row["line"]) for row in published]
    nominal_rpm, shaft_rpm = findings.analyses["rig"][Fault.OUTER].recording.nominal_rpm, findings.printed.shaft_rpm
    at_rig = TEXTS.table(
        "table-6-rig-speed", map(to_json, measured), nominal_rpm=nominal_rpm, verdict_tone=VERDICT_TONE
    )
    parts = measured[0]["uncertainty_parts_pct"] if measured else ()  # no line found: nothing was compared
    verdicts = findings.headline.verdicts
    power = {
        (row["endpoint"], row["planted_pct"]): row["missed"]
        for row in findings.results.content("verdict_power").get("rows", ())
    }
    return TEXTS.section(
        TEXTS.table("verdicts", verdicts, listed=verdicts, power=power, tone=ANSWER_TONE),
        TEXTS.table("table-6-paper-speed", map(to_json, published), shaft_rpm=shaft_rpm, computed=computed),
        TEXTS.figure("table6-deviations", deviation_plot([point for row in rows for point in _points(row)])),
        at_rig,
        TEXTS.paragraph("how-to-read"),
        appendix=(
            TEXTS.table("uncertainty-parts", parts, compared=measured),
            TEXTS.table("quantities", map(to_json, findings.data["comparisons"]), verdict_tone=VERDICT_TONE),
        ),
    )


def _points(row: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The sources of one row of Table 6, as `report.json` has it."""
    sources = [("our model", "simulated", row["model_deviation_pct"], row["model_ci95_hz"])]
    if row["rig_source"] == "measured":
        sources += [("rig, measured", "measured", row["rig_deviation_pct"], row["rig_ci95_hz"])]
    else:
        sources += [("paper's rig", "published", row["rig_deviation_pct"], None)]
        sources += [("paper's model", "published", row["paper_model_recomputed_pct"], None)]
    return [
        {
            "group": f"{Fault(row['defect']).code} at {row['shaft_rpm']:.0f} rpm", "source": source, "kind": kind,
            "deviation_pct": deviation, "ci95_pct": 100 * ci95 / row["kinematic_hz"] if ci95 else None,
        }
        for source, kind, deviation, ci95 in sources
    ]  # fmt: skip


def speed_or_slip_section(findings: Findings) -> Section:
    """BPFO + BPFI against the number of rollers, and the plain statement; in the appendix what each line says."""
    inner, rollers = findings.printed.of("inner"), findings.bearing.rolling_elements
    sums = findings.data["closure"]
    measured = [r for r in findings.data["speed_and_slip"] if r.origin == "measured" and r.speed_source == "tachometer"]
    return SPEED.section(
        SPEED.paragraph("intro", rollers=rollers),
        SPEED.table(
            "sum-rule-table",
            sums,
            rollers=rollers,
            slip_difference=next(s.slip_difference for s in sums if s.origin == "simulated"),
        ),
        SPEED.callout(
            "statement",
            tone=Tone.NEUTRAL,
            printed_pct=inner.rig_printed_pct,
            inner_rpm=findings.printed.shaft_rpm * inner.rig_hz / inner.kinematic_hz,
            rig=next(s for s in sums if s.source == "paper's rig"),
            measured_sum=next((s for s in sums if s.origin == "measured"), None),
            measured=measured,
            listed=LISTED,
        ),
        appendix=_each_line(findings, rollers),
    )


def _each_line(findings: Findings, rollers: int) -> Iterator[Block]:
    """Speed and slip of every line, records with both race lines, and the published speeds."""
    means = findings.data["published_speeds"]
    speeds = [
        {"state": state} | {row["nominal_rpm"]: row for row in means if row["state"] is state}
        for state in dict.fromkeys(row["state"] for row in means)
    ]
    nominal = list(dict.fromkeys(row["nominal_rpm"] for row in means))
    yield SPEED.paragraph("each-line")
    yield SPEED.table("speed-and-slip-table", findings.data["speed_and_slip"])
    for rig in findings.analyses["rig"].values():
        if rig.closure.sum_hz is not None:
            yield SPEED.paragraph("own-sum", name=rig.recording.name, closure=rig.closure, rollers=rollers)
    yield SPEED.table("published-speeds", speeds, nominal_rpm=nominal, source=findings.speed_source)
    inner = next(r for r in findings.data["speed_and_slip"] if r.origin == "published" and r.line == "BPFI")
    yield SPEED.paragraph("inner-line", inner=inner, single=findings.data["single_speed"])
