"""The answer on the cage speed and its reasons; Table 6 at the paper's speed and the recordings' own; speed or slip."""

from collections.abc import Iterator

from srbval.bearing import Fault
from srbval.comparison.budget import STATED, Answer
from srbval.report.blocks import Block, Section, Tone, VerdictBox
from srbval.report.figures.comparison import cage_ratio_plot
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import VERDICT_TONE, Texts
from srbval.storage.json_files import to_json

CAGE, TEXTS, SPEED = Texts("cage_ratio"), Texts("table6"), Texts("speed_and_slip")
LISTED = 4  # so many measured records are named one by one
ANSWER_TONE = {Answer.MISSED: Tone.BAD, Answer.NOT_RESOLVED: Tone.NEUTRAL, Answer.MET: Tone.GOOD}  # the worst first


def verdict_box(findings: Findings) -> VerdictBox:
    """First on the page: all from the verdicts."""
    data, found = findings.data, findings.headline
    rpm = list(dict.fromkeys(f"{row['nominal_rpm']:g}" for row in data["cage_ratios"]))
    picture = CAGE.figure("cage-ratios", cage_ratio_plot(data["cage_ratios"]), rows=data["cage_ratios"], speeds=rpm)
    answers = [one.verdict for one in found.stated]
    return CAGE.verdict(
        next((tone for answer, tone in ANSWER_TONE.items() if answer in answers), Tone.WARNING), figure=picture,
        found=found, readings=data["cage_readings"], trend=data["trend"], slowest=f"{rpm[0]} rpm",
        fastest=f"{rpm[-1]} rpm", looks=data["second_look"],
        turning=[look for look in data["second_look"] if look["turned"]],
    )  # fmt: skip


def cage_ratio_section(findings: Findings) -> Section:
    """Reasons, verdicts with their power, readings; in the appendix the second look."""
    data = findings.data
    rows = findings.results.content("verdict_power").get("rows", ())
    power = {(row["endpoint"], row["planted_pct"]): row["missed"] for row in rows}
    tests = data["joint_tests"]
    return CAGE.section(
        CAGE.listing("reasons", found=findings.headline, tests=tests, stated=STATED),
        CAGE.table("verdicts", data["verdicts"], listed=data["verdicts"], power=power, tone=ANSWER_TONE),
        CAGE.table("cage-readings", data["cage_readings"]),
        appendix=(
            CAGE.table("second-look", data["second_look"]),
            CAGE.table("joint-tests", tests, endpoints=tests[0]["endpoints"] if tests else ()),
        ),
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
    return TEXTS.section(
        TEXTS.table("table-6-paper-speed", map(to_json, published), shaft_rpm=shaft_rpm, computed=computed),
        at_rig,
        TEXTS.paragraph("how-to-read"),
        appendix=(
            TEXTS.table("uncertainty-parts", parts, compared=measured),
            TEXTS.table("quantities", map(to_json, findings.data["comparisons"]), verdict_tone=VERDICT_TONE),
        ),
    )


def speed_or_slip_section(findings: Findings) -> Section:
    """BPFO + BPFI against the number of rollers, and the plain statement; in the appendix what each line says."""
    inner, rollers = findings.printed.of("inner"), findings.bearing.rolling_elements
    sums = findings.data["closure"]
    measured = [
        r for r in findings.data["speed_and_slip"] if (r["origin"], r["speed_source"]) == ("measured", "tachometer")
    ]
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
    inner = next(r for r in findings.data["speed_and_slip"] if (r["origin"], r["line"]) == ("published", "BPFI"))
    yield SPEED.paragraph("inner-line", inner=inner, single=findings.data["single_speed"])
