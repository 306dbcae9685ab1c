"""The answer on the cage speed, and its reasons."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.comparison.comparison import TOLERANCE, Verdict
from srbval.report.blocks import Badge, Section, Tone, VerdictBox
from srbval.report.figures.comparison import cage_ratio_plot
from srbval.report.findings.findings import Findings
from srbval.report.pages import first_line
from srbval.report.prose import Prose

TEXTS = Prose("srbval.report", "texts/answer.md")
# Tones of verdicts with a tolerance, the worst first.
ANSWER_TONE = {Verdict.MISSED: Tone.BAD, Verdict.NOT_RESOLVED: Tone.NEUTRAL, Verdict.MET: Tone.GOOD}
SCENES = {"paper": "paper's scene", "rig": "the rig's own scene"}
Row = Mapping[str, Any]


def verdict_box(findings: Findings) -> VerdictBox:
    """The first thing on the page: the verdicts in a sentence and the cage ratios in a picture."""
    data, stated = findings.data, stated_verdicts(findings)
    ratios = findings.frame("cage_ratios")
    speeds = list(dict.fromkeys(f"{rpm:g}" for rpm in ratios["nominal_rpm"]))
    summaries = ratios[ratios["of"] != "record"].to_dict("records")
    values = ", ".join(f"{row['of']} {row['ratio']:.4f} at {row['nominal_rpm']:g} rpm" for row in summaries)
    plot, trend, ends = cage_ratio_plot(data["cage_ratios"]), data["trend"], (f"{speeds[0]} rpm", f"{speeds[-1]} rpm")
    low, high = trend["between_records_ci95_pct"]
    between = {"between_pct": trend["between_records_pct"], "low_pct": low, "high_pct": high}
    records = TEXTS.text("records", records=len(data["cage_readings"]), **between)
    return VerdictBox(
        tone=tone_of(row["verdict"] for row in stated),
        headline=headline(stated, trend["endpoint"], *ends),
        points=(trend_sentence(trend, *ends), records, TEXTS.text("below")),
        figure=TEXTS.figure("cage-ratios", plot, wide=False, speeds=" and ".join(speeds), values=values),
    )


def stated_verdicts(findings: Findings) -> list[Row]:
    """Verdicts on the scenes `paper` and `rig`."""
    rows: list[Row] = findings.frame("verdicts").to_dict("records")
    return rows


def tone_of(answers: Iterator[str]) -> Tone:
    """Tone of the worst answer; a warning if there is none."""
    found = set(answers)
    return next((tone for answer, tone in ANSWER_TONE.items() if answer in found), Tone.WARNING)


def headline(stated: Sequence[Row], trend_endpoint: str, slowest: str, fastest: str) -> str:
    """The answer in one sentence: each scene at the fastest speed, and its change to the slowest speed."""
    if not stated:
        return TEXTS.text("headline-unknown")
    answers = []
    for scene in sorted({row["scene"] for row in stated}):
        of = {row["endpoint"]: row for row in stated if row["scene"] == scene}
        parts = [f"{of[fastest]['verdict']} at {fastest} {_error(of[fastest])}"] if fastest in of else []
        if trend_endpoint != fastest and trend_endpoint in of:
            parts.append(f"change to {slowest} {of[trend_endpoint]['verdict']} {_error(of[trend_endpoint])}")
        answers.append(f"{SCENES.get(scene, scene)} {', '.join(parts)}")
    return TEXTS.text("headline", limit_pct=TOLERANCE.limit_pct, answers="; ".join(answers))


def trend_sentence(trend: Row, slowest: str, fastest: str) -> str:
    """Sentence on the change of the cage ratio with speed: of the rig, and of the model if it is known."""
    model = "" if trend["model_pct"] is None else TEXTS.text("trend-of-model", **trend)
    return TEXTS.text("trend", **trend, slowest=slowest, fastest=fastest, model=model)


def cage_ratio_section(findings: Findings) -> Section:
    """Reasons, verdicts with their power, readings."""
    stated = stated_verdicts(findings)
    readings, tolerance = findings.frame("cage_readings"), vars(TOLERANCE) | {"rest": 1 - TOLERANCE.risk}
    shown = readings.assign(
        ratio_ci95=1.96 * readings["reading_u"],
        ratio_badge=Badge.MEASURED,
        tachometer=1.96 * readings["speed_u"],
        band=[f"{low:g} to {high:g}" for low, high in readings["band_hz"]],
    )
    verdicts = list(_verdict_rows(stated, findings))
    return TEXTS.section(
        first_line(findings.results, "inputs"),
        TEXTS.listing("reasons", **tolerance),
        TEXTS.table("verdicts", verdicts, more_notes=reversed_notes(stated), **tolerance),
        TEXTS.table("cage-readings", shown),
    )


def reversed_notes(stated: Sequence[Row]) -> tuple[str, ...]:
    """A note for each verdict that one input alone, over its range, turns from met to missed."""
    return tuple(
        TEXTS.text("reversed", scene=row["scene"], endpoint=row["endpoint"], inputs=", ".join(row["reversed_by"]))
        for row in stated
        if row["reversed_by"]
    )


def _verdict_rows(stated: Sequence[Row], findings: Findings) -> Iterator[dict[str, Any]]:
    rigs = findings.results.content("inputs").get("power", ())
    power = {(row["endpoint"], row["planted_pct"]): row["missed"] for row in rigs}
    for row in stated:
        found = power.get((row["endpoint"], 2 * TOLERANCE.limit_pct)) if row["scene"] == "rig" else None
        changed = [name.replace("line_contact.", "") for name in row["changed_by"]]
        more = {"power": found, "changed": ", ".join(changed) or "none", "verdict_tone": ANSWER_TONE[row["verdict"]]}
        yield {**row, **more}


def _error(row: Row) -> str:
    return f"({row['error_pct']:+.2f} ± {row['u_pct']:.2f} %)"
