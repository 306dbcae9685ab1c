"""The answer: model against rig in cage speed, as one sentence, one picture and three points; and what it rests on."""

from srbval.comparison.budget import STATED, Answer
from srbval.report.blocks import Section, Tone, VerdictBox
from srbval.report.figures.comparison import cage_ratio_plot
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import Texts

TEXTS = Texts("cage_ratio")
ANSWER_TONE = {Answer.MISSED: Tone.BAD, Answer.NOT_RESOLVED: Tone.NEUTRAL, Answer.MET: Tone.GOOD}  # the worst first


def verdict_box(findings: Findings) -> VerdictBox:
    """First on the page: all from the verdicts."""
    data, found = findings.data, findings.headline
    rpm = list(dict.fromkeys(f"{row['nominal_rpm']:g}" for row in data["cage_ratios"]))
    picture = TEXTS.figure("cage-ratios", cage_ratio_plot(data["cage_ratios"]), rows=data["cage_ratios"], speeds=rpm)
    answers = [one.verdict for one in found.stated]
    return TEXTS.verdict(
        next((tone for answer, tone in ANSWER_TONE.items() if answer in answers), Tone.WARNING), figure=picture,
        found=found, readings=data["cage_readings"], trend=data["trend"], slowest=f"{rpm[0]} rpm",
        fastest=f"{rpm[-1]} rpm", turning=[look for look in data["second_look"] if look.turned],
        judged=[(cell.state, cell.nominal_rpm, cell.verdict) for cell in findings.matrix.cells if cell.judged],
    )  # fmt: skip


def cage_ratio_section(findings: Findings) -> Section:
    """Reasons, verdicts with their power, readings; in the appendix the second look."""
    data = findings.data
    rows = findings.results.content("verdict_power").get("rows", ())
    power = {(row["endpoint"], row["planted_pct"]): row["missed"] for row in rows}
    tests = data["joint_tests"]
    return TEXTS.section(
        TEXTS.listing("reasons", found=findings.headline, tests=tests, stated=STATED),
        TEXTS.table("verdicts", data["verdicts"], listed=data["verdicts"], power=power, tone=ANSWER_TONE),
        TEXTS.table("cage-readings", data["cage_readings"]),
        appendix=(
            TEXTS.table("second-look", data["second_look"]),
            TEXTS.table("joint-tests", tests, endpoints=tests[0].endpoints if tests else ()),
        ),
    )
