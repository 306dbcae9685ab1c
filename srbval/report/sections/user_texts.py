"""Sentences of the report on a user's recordings that depend on what was found."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.diagnosis.baseline import Baseline
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line, NotDetected
from srbval.recordings import SpeedSource
from srbval.report.blocks import Paragraph
from srbval.report.findings.user_records import ModelSide, UserRecord
from srbval.report.plain import literal
from srbval.report.prose import Prose

TEXTS = Prose("srbval.report", "texts/user_report.md")
LEAST_SHARE = 0.005  # probabilities below this one are not listed
MOST_NAMED = 6  # recordings that a point lists by name
SPEED_WORDS = {
    "tachometer": "from the tachometer",
    "stated": "as stated",
    "estimated": "estimated from the vibration itself",
    "nominal": "nominal, not measured",
    "prescribed": "prescribed",
}
HEALTHY = " Dashed grey: the healthy record."
Row = Mapping[str, Any]


def headline_of_all(summaries: Sequence[Row]) -> str:
    """The worst finding of several recordings, with its number."""
    named, undecided, clear = (sum(row["alarm"] == alarm for row in summaries) for alarm in ("yes", "check", "no"))
    counts = {"records": len(summaries), "named": named, "undecided": undecided, "clear": clear}
    if named:
        return TEXTS.text("headline-named", **counts) + (f"; {undecided} undecided" if undecided else "")
    return TEXTS.text("headline-check" if undecided else "headline-nothing" if clear else "headline-none", **counts)


def points_of_all(summaries: Sequence[Row], failed: int) -> Iterator[str]:
    """The recordings with a named fault, the undecided ones, and the number of files that are not in the report."""
    for title, alarm in (("Named", "yes"), ("Undecided", "check")):
        rows = [row for row in summaries if row["alarm"] == alarm]
        shown = [literal(row["name"]) + (f" ({row['state']})" if alarm == "yes" else "") for row in rows[:MOST_NAMED]]
        more = f" and {len(rows) - MOST_NAMED} more" if len(rows) > MOST_NAMED else ""
        if rows:
            yield f"**{title}:** {', '.join(shown)}{more}."
    if failed:
        yield TEXTS.text("not-in-report", failed=f"{failed} file{'s' if failed > 1 else ''}")


def points_of_one(record: UserRecord) -> Iterator[str]:
    """The comparison with the healthy record or the first reason, the summary, and the probabilities with cautions."""
    verdict, analysis = record.verdict, record.analysis
    if first := verdict.comparison.sentence or (verdict.reasons[0] if verdict.diagnosis else ""):
        yield literal(first)
    yield literal(analysis.summary)
    shares = verdict.diagnosis.probabilities if verdict.diagnosis else {}
    listed = [
        f"{'something else' if name == 'other' else Fault(name).label} {100 * share:.0f} %"
        for name, share in sorted(shares.items(), key=lambda one: -one[1])
        if share >= LEAST_SHARE
    ]
    parts = [f"By the record alone: {', '.join(listed)}."] if listed else []
    parts += [TEXTS.text("caution", caution=caution) for caution in analysis.recording.cautions]
    if parts:
        yield " ".join(parts)


def fact_items(analysis: Analysis) -> tuple[str, ...]:
    """Record, shaft speed, band and search windows."""
    recording, speed, (low_hz, high_hz) = analysis.recording, analysis.speed, analysis.processed.band_hz
    given = {name: getattr(recording, name) for name in ("seconds", "fs_hz", "unit")}
    given |= {"file": (recording.file or recording.name).split("/")[-1], "origin": recording.origin.value}
    given["declared"] = f", declared {recording.state.label}" if recording.state else ""
    given["channel"] = f", channel {recording.channel}" if recording.channel else ""
    given |= {"rpm": 60 * speed.value_hz, "rpm_ci95": 60 * speed.ci95_hz, "source": SPEED_WORDS[speed.source.value]}
    given |= {"low_hz": low_hz, "high_hz": high_hz, "why": analysis.band.why, "search": analysis.search}
    return TEXTS.items("facts", **given)


def unseen_reason(line: Line, **limits: float) -> str:
    """Why a line is not detected: `reach_hz` of the envelope and `least_snr` are the limits."""
    why = line.not_detected or NotDetected.OWN
    name = "flank" if why is NotDetected.OWN else why.value.replace(" ", "-")
    if why is NotDetected.HIDDEN and line.snr:
        name += "-snr"
    return TEXTS.text(name, line=line, **limits)


def baseline_items(record: UserRecord, baseline: Baseline) -> Iterator[str]:
    """The healthy record, what it shows, and what makes the comparison doubtful."""
    yield TEXTS.text("healthy", name=baseline.analysis.recording.name)
    if record.verdict.comparison.sentence:
        yield literal(record.verdict.comparison.sentence)
    if not baseline.conditions:
        yield TEXTS.text("same-conditions")
    if baseline.remarks:
        yield literal(" ".join(f"{remark[0].upper()}{remark[1:]}." for remark in baseline.remarks))
    if cautions := baseline.analysis.recording.cautions:
        yield " ".join(TEXTS.text("caution", caution=caution) for caution in cautions)


def model_paragraph(model: ModelSide) -> Paragraph:
    """Paragraph on the model, its defect, and the open dimensions of the bearing."""
    opened = f"{TEXTS.text('open-cage', angle_deg=model.open_cage.angle_deg)} " if model.open_cage else ""
    scene = "" if model.open_cage else f", scene `{model.base}`"
    defect = f"a defect of the {model.state.label}" if model.state.line else "no defect"
    load = " and load" if model.stated_load else "; the record states no load, so the scene's own was taken"
    words = {"scene": scene, "defect": defect, "load": load, "open_cage": opened}
    return TEXTS.paragraph("model", model=model.run.scene.model, **words)


def limit_items(records: Sequence[UserRecord]) -> Iterator[str]:
    """Limits of the report that apply to these records."""
    yield from TEXTS.items("limits")
    if not any(record.baseline for record in records):
        yield TEXTS.text("no-healthy")
    if any(record.analysis.band.trials > 1 for record in records):
        yield TEXTS.text("band-chosen")
    if any(record.analysis.speed.source is SpeedSource.NOMINAL for record in records):
        yield TEXTS.text("speed-nominal")


def spectrum_words(record: UserRecord) -> dict[str, Any]:
    """The words of the envelope spectrum's caption and alt text."""
    marked, view = record.marked, record.view
    sidebands = " and sidebands" if marked and marked.name != "BPFO" else ""
    return {
        "marked": f", with harmonics{sidebands} of {marked.name}" if marked else "",
        "healthy": HEALTHY if view.healthy else "",
        "end_hz": view.end_hz,
        "detected": ", ".join(dict.fromkeys(name for name, *_ in view.record.peaks)) or "none",
    }
