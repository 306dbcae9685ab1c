"""Report on a user's recordings: verdict, spectra, fault lines, comparison with a healthy record and the model."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import Fault
from srbval.diagnosis.baseline import Baseline
from srbval.diagnosis.fault_posterior import FAULT_PAIRS, LABELS
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import FailedFile
from srbval.reading.lines import Line, NotDetected
from srbval.reading.pipeline import USABLE_SHARE
from srbval.recordings import SpeedSource
from srbval.report.blocks import (
    REPORT_SCHEMA,
    Block,
    Figure,
    Heading,
    Listing,
    Report,
    ReportRow,
    ReportTable,
    Section,
    Tone,
    VerdictBox,
)
from srbval.report.figures import style
from srbval.report.figures.signals import acceleration_panel, band_panel, spectrum_panel
from srbval.report.figures.style import HALF, WIDE, PanelData, panel
from srbval.report.findings.records import SEGMENT_HZ, detected_peaks, first_lines
from srbval.report.findings.user_records import ModelSide, UserRecord, summary_rows
from srbval.report.plain import literal
from srbval.report.prose import Prose
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import HEAD_ROOM, explore_spectrum
from srbval.signal import LEAST_SNR

USER_TEXTS = Prose("srbval.report", "texts/user_report.md")
MIN_PROBABILITY = 0.005  # probabilities below this one are not listed
MAX_NAMES = 6  # recordings that a point lists by name
RECORD_NAMES = ("this record", "healthy record")
BRIEF_SECTIONS = ("answer", "lines")
HEALTHY_CURVE_NOTE = " Dashed grey: the healthy record."
SPEED_WORDS = {
    "tachometer": "from the tachometer",
    "stated": "as stated",
    "estimated": "estimated from the vibration itself",
    "nominal": "nominal, not measured",
    "prescribed": "prescribed",
}
STATE_COLOURS = {"outer": style.VERMILION, "inner": style.PURPLE, "roller": style.ORANGE, "other": style.SOFT}
STATE_COLOURS |= {"two parts": "#6b4a3a", "open": "#c9c2b2", "healthy": "#9fd3bd"}
MAX_LABEL_CHARACTERS = 34  # characters of a recording's name
MAX_PROBABILITY_BARS = 12  # recordings in the figure on the first screen, which also contains the points
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0
FINDING_TONES: dict[Finding | None, Tone] = {None: Tone.NEUTRAL, Finding.NOTHING_FOUND: Tone.GOOD}
FINDING_TONES |= {Finding.NAMED: Tone.BAD, Finding.UNDECIDED: Tone.WARNING}
ALARM_TONES = {"yes": Tone.BAD, "check": Tone.WARNING, "-": Tone.NEUTRAL, "no": Tone.GOOD}  # the worst first


def assemble_user_report(
    records: Sequence[UserRecord],
    *,
    command: str,
    provenance: Mapping[str, Any],
    failed: Sequence[FailedFile] = (),
    others: Sequence[Mapping[str, Any]] = (),
    brief: bool = False,
) -> Report:
    """Build the report on a user's recordings; `command` is printed as the command that repeats it.

    `others` are JSON documents of recordings without a section. If `brief`, the report has only the first record's
    answer, reasons and table of lines.
    """
    origin, several = {"command": command, **provenance}, len(records) + len(others) > 1
    if several:
        summaries = summary_rows([*records, *others])
        faults = [*(record.verdict.to_dict() for record in records), *(one["fault"] for one in others)]
        with_channel = len({row["name"] for row in summaries}) < len(summaries)
        names = [f"{row['name']} {row['channel'] or ''}" if with_channel else row["name"] for row in summaries]
        bars = [(name, one["probabilities"]) for name, one in zip(names, faults, strict=True) if one["probabilities"]]
        verdict = _verdict_of_all(summaries, bars, len(failed))
        frame = pd.DataFrame(summaries).assign(recording=names)
        percent, tones = 100 * frame["probability"].astype(float), frame["alarm"].map(ALARM_TONES)
        shown = frame.assign(probability=percent, state_tone=tones)
        sections = [_section("overview", USER_TEXTS.table("overview-table", shown, sections=len(records)), open=True)]
        for number, (record, name, row) in enumerate(zip(records, names, summaries, strict=False), start=1):
            parts = [block for one in _sections(record, f"-{number}") for block in (Heading(one.title), *one.blocks)]
            blocks = (_spectrum(record, f"-{number}"), *parts)
            sections.append(Section(id=f"record-{number}", title=f"{name}: {row['state']}", blocks=blocks))
    else:
        points, of_one = tuple(points_of_one(records[0])), records[0].verdict
        headline, figure = literal(of_one.headline), _spectrum(records[0], "")
        verdict = VerdictBox(tone=FINDING_TONES[of_one.finding], headline=headline, points=points, figure=figure)
        sections = [one for one in _sections(records[0], "") if not brief or one.id in BRIEF_SECTIONS]
    if failed:
        reasons = [str(one.error) if one.file in str(one.error) else f"{one.file}: {one.error}" for one in failed]
        sections.insert(1, _section("failed", Listing(tuple(map(literal, reasons))), open=True))
    if not brief:
        sections += [_section("limits", Listing(tuple(limit_items(records)))), provenance_section(origin)]
    first, count = records[0].analysis, len(records) + len(others)
    rpm = f", {60 * first.speed.value_hz:.5g} rpm" if len(records) == 1 else ""
    return Report(
        title=f"Bearing report: {f'{count} recordings' if several else first.recording.name}",
        subtitle=f"{first.bearing.title}{rpm}",
        verdict=verdict,
        sections=tuple(sections),
        data={
            "schema_version": REPORT_SCHEMA,
            "status": "incomplete" if failed else "ok",
            "headline": {"text": " ".join(verdict.headline.replace("**", "").split())},
            "bearing": first.bearing,
            "records": (*records, *others),
            "failed": tuple(failed),
            "provenance": origin,
        },
        rows={f"all-lines-{n}": record.analysis.lines for n, record in enumerate(records, start=1)},
    )


def _verdict_of_all(
    summaries: Sequence[Mapping[str, Any]], bars: Sequence[tuple[str, Mapping[str, float]]], failed: int
) -> VerdictBox:
    """Make the verdict on all recordings; `bars` are their names and probabilities, `failed` counts failed files."""
    alarms, shown = {row["alarm"] for row in summaries}, bars[:MAX_PROBABILITY_BARS]
    highest = [(name, max(shares.items(), key=lambda one: one[1])) for name, shares in shown]
    words: dict[str, Any] = {
        "first": f": the first {len(shown)} of {len(bars)}" if len(bars) > len(shown) else "",
        "shown": ", ".join(f"{name} {state} {100 * share:.0f} %" for name, (state, share) in highest),
    }
    return VerdictBox(
        tone=next(tone for alarm, tone in ALARM_TONES.items() if alarm in alarms),
        headline=headline_of_all(summaries),
        points=tuple(points_of_all(summaries, failed)),
        figure=USER_TEXTS.figure("probabilities", probabilities_plot(shown), **words) if shown else None,
    )


@panel
def probabilities_plot(rows: Sequence[tuple[str, Mapping[str, float]]]) -> PanelData:
    """Draw one stacked bar per recording; `rows` are pairs of recording name and probabilities of bearing states."""
    axes = style.new_axes((7.6, 0.85 + 0.2 * len(rows)))
    left = [0.0] * len(rows)
    places, columns = range(len(rows)), dict[str, Any](recording=[name for name, _ in rows])
    for state, colour in STATE_COLOURS.items():
        own = [state] if state != "two parts" else FAULT_PAIRS.values()
        shares = [100 * sum(shown.get(name, 0.0) for name in own) for _, shown in rows]
        axes.barh(places, shares, left=left, color=colour, height=0.72, label=LABELS.get(state, state))
        left = [one + more for one, more in zip(left, shares, strict=True)]
        columns |= {f"{state}_pct": shares}
    names = [name if len(name) <= MAX_LABEL_CHARACTERS else f"…{name[1 - MAX_LABEL_CHARACTERS :]}" for name, _ in rows]
    axes.set_yticks(places, labels=names, parse_math=False)
    axes.set(xlim=(0, 100), ylim=(len(rows) - 0.4, -0.6), xlabel="Probability, %")
    axes.grid(False, axis="y")
    style.legend_above(axes)
    return axes.figure, columns


def headline_of_all(summaries: Sequence[ReportRow]) -> str:
    """State how many of several recordings have a named fault, are undecided, or show no fault."""
    named, undecided, clear = (sum(row["alarm"] == alarm for row in summaries) for alarm in ("yes", "check", "no"))
    counts = {"records": len(summaries), "named": named, "undecided": undecided, "clear": clear}
    if named:
        return USER_TEXTS.text("headline-named", **counts) + (f"; {undecided} undecided" if undecided else "")
    name = "check" if undecided else "nothing" if clear else "none"
    return USER_TEXTS.text(f"headline-{name}", **counts)


def points_of_all(summaries: Sequence[ReportRow], failed: int) -> Iterator[str]:
    """List the recordings with a named fault, the undecided recordings, and the number of files that failed."""
    for title, alarm in (("Named", "yes"), ("Undecided", "check")):
        rows = [row for row in summaries if row["alarm"] == alarm]
        shown = [literal(row["name"]) + (f" ({row['state']})" if alarm == "yes" else "") for row in rows[:MAX_NAMES]]
        more = f" and {len(rows) - MAX_NAMES} more" if len(rows) > MAX_NAMES else ""
        if rows:
            yield f"**{title}:** {', '.join(shown)}{more}."
    if failed:
        yield USER_TEXTS.text("not-in-report", failed=f"{failed} file{'s' if failed > 1 else ''}")


def points_of_one(record: UserRecord) -> Iterator[str]:
    """List the points on one recording: comparison with the healthy record, summary, probabilities, and cautions."""
    verdict, analysis = record.verdict, record.analysis
    if first := verdict.comparison.sentence or (verdict.reasons[0] if verdict.diagnosis else ""):
        yield literal(first)
    yield literal(analysis.summary)
    shares = verdict.diagnosis.probabilities if verdict.diagnosis else {}
    listed = [
        f"{LABELS[name]} {100 * share:.0f} %"
        for name, share in sorted(shares.items(), key=lambda one: -one[1])
        if share >= MIN_PROBABILITY
    ]
    parts = [f"Probabilities: {', '.join(listed)}."] if listed else []
    parts += [USER_TEXTS.text("caution", caution=caution) for caution in analysis.recording.cautions]
    if parts:
        yield " ".join(parts)


def unseen_reason(line: Line, **limits: float) -> str:
    """State why a line is not detected; `limits` are the highest usable frequency and the lowest detectable SNR."""
    why = line.not_detected or NotDetected.OWN
    name = "flank" if why is NotDetected.OWN else why.name.lower().replace("_", "-")
    if why is NotDetected.HIDDEN and line.snr:
        name += "-snr"
    return USER_TEXTS.text(name, line=line, **limits)


def baseline_items(record: UserRecord, baseline: Baseline) -> Iterator[str]:
    """Name the healthy record used for comparison, the result, and the reasons to doubt the comparison."""
    yield USER_TEXTS.text("healthy", name=baseline.analysis.recording.name)
    if record.verdict.comparison.sentence:
        yield literal(record.verdict.comparison.sentence)
    if not baseline.conditions:
        yield USER_TEXTS.text("same-conditions")
    if baseline.remarks:
        yield literal(" ".join(f"{remark[0].upper()}{remark[1:]}." for remark in baseline.remarks))
    if cautions := baseline.analysis.recording.cautions:
        yield " ".join(USER_TEXTS.text("caution", caution=caution) for caution in cautions)


def limit_items(records: Sequence[UserRecord]) -> Iterator[str]:
    """List the limitations of the report on these records."""
    yield from USER_TEXTS.items("limits")
    if not any(record.baseline for record in records):
        yield USER_TEXTS.text("no-healthy")
    if any(record.analysis.band.trials > 1 for record in records):
        yield USER_TEXTS.text("band-chosen")
    if any(record.analysis.speed.source is SpeedSource.NOMINAL for record in records):
        yield USER_TEXTS.text("speed-nominal")


def _section(about: str, *blocks: Block, open: bool = False) -> Section:
    return Section(id=about, title=USER_TEXTS.text(f"title-{about}"), blocks=blocks, open=open)


def _sections(record: UserRecord, suffix: str) -> Iterator[Section]:
    """Make the sections of one record; `suffix` makes the ids of its figures and tables unique."""
    verdict, analysis, recording = record.verdict, record.analysis, record.analysis.recording
    speed, (low_hz, high_hz) = analysis.speed, analysis.processed.band_hz
    given: dict[str, Any] = {"file": (recording.file or recording.name).split("/")[-1], "recording": recording}
    given["declared"] = f", declared {recording.state.label}" if recording.state else ""
    given["channel"] = f", channel {recording.channel}" if recording.channel else ""
    given |= {"rpm": 60 * speed.value_hz, "rpm_ci95": 60 * speed.ci95_hz, "source": SPEED_WORDS[speed.source.value]}
    given |= {"low_hz": low_hz, "high_hz": high_hz, "analysis": analysis}
    reasons = (" ".join(verdict.reasons), verdict.describe_declared(recording.state))
    shown = Listing(tuple(literal(reason) for reason in reasons if reason))
    yield _section("answer", shown, Listing(USER_TEXTS.items("facts", **given)))
    yield _section("lines", _lines_table(record, suffix), *_not_detected(record))
    yield _section("signal", _band(record, suffix), _times(record, suffix))
    if record.baseline is not None:
        yield _section("baseline", Listing(tuple(baseline_items(record, record.baseline))))
    if isinstance(record.model, str):
        yield _section("model", USER_TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model))
    elif record.model is not None:
        yield _section("model", *_model(record, record.model, suffix))


def _spectrum(record: UserRecord, suffix: str) -> Figure:
    """Draw the envelope spectrum with the expected fault frequencies; `suffix` makes the figure's id unique."""
    view, marked = record.view, record.marked
    plot = spectrum_panel(view, title="envelope spectrum")
    curves = {"amplitude": "this record"} | ({"healthy_amplitude": "healthy record"} if view.healthy else {})
    sidebands = " and sidebands" if marked and marked.name != "BPFO" else ""
    words: dict[str, Any] = {
        "id": f"spectrum-figure{suffix}",
        "badge": view.record.origin,
        "marked": f", with harmonics{sidebands} of {marked.name}" if marked else "",
        "healthy": HEALTHY_CURVE_NOTE if view.healthy else "",
        "end_hz": view.end_hz,
        "detected": ", ".join(dict.fromkeys(name for name, *_ in view.record.peaks)) or "none",
    }
    explore = explore_spectrum(view, f"Envelope, {view.record.unit}", curves)
    return USER_TEXTS.figure("spectrum", plot, explore=explore, **words)


def _lines_table(record: UserRecord, suffix: str) -> ReportTable:
    before = record.baseline and {x.name: x for x in record.baseline.analysis.lines if x.harmonic == 1}
    rows = [_line_row(line, before.get(line.name) if before else None) for line in first_lines(record.analysis)]
    columns = USER_TEXTS.columns("lines-table")
    if before is None:
        del columns["healthy_pct"]
    return USER_TEXTS.table("lines-table", rows, columns, id=f"lines-table{suffix}")


def _line_row(line: Line, healthy: Line | None) -> dict[str, Any]:
    fault = Fault.of_line(line.name)
    return vars(line) | {
        "part": fault.label if fault else "cage",
        "found_hz": line.found_hz if line.detected else None,
        "found_hz_ci95": line.ci95_hz,
        "deviation_pct": line.stated().deviation_pct,
        "deviation_pct_ci95": line.deviation_ci95_pct,
        "depth_pct": None if line.depth is None else 100 * line.depth,
        "healthy_pct": None if healthy is None or healthy.depth is None else 100 * healthy.depth,
        "false_alarm": line.false_alarm,
        "seen": "yes" if line.detected else "no",
        "seen_tone": Tone.WARNING if line.detected and fault else Tone.NEUTRAL,
    }


def _not_detected(record: UserRecord) -> Iterator[Block]:
    if unseen := [line for line in first_lines(record.analysis) if not line.detected]:
        low, high = record.analysis.processed.band_hz
        limits = {"reach_hz": USABLE_SHARE * (high - low), "least_snr": LEAST_SNR}
        yield USER_TEXTS.paragraph("unseen-intro")
        yield Listing(tuple(USER_TEXTS.text("unseen", line=line, why=unseen_reason(line, **limits)) for line in unseen))


def _band(record: UserRecord, suffix: str) -> Figure:
    view, (low_hz, high_hz) = record.view, record.analysis.processed.band_hz
    records = dict(reversed([*zip(RECORD_NAMES, view.records, strict=False)]))  # the healthy record is drawn first
    top = max(float(np.nanmax(one.power_db)) for one in records.values()) + BAND_HEAD_DB
    low = min(float(np.nanmin(one.power_db)) for one in records.values()) - BAND_HEAD_DB
    plot = band_panel(records, limits_db=(max(low, top - BAND_RANGE_DB), top), end_hz=float(view.record.power_hz[-1]))
    words: dict[str, Any] = {"low_hz": low_hz, "high_hz": high_hz, "resolution_hz": SEGMENT_HZ}
    words |= {"id": f"band-figure{suffix}", "badge": view.record.origin}
    return USER_TEXTS.figure("band", plot, healthy=HEALTHY_CURVE_NOTE if view.healthy else "", **words)


def _times(record: UserRecord, suffix: str) -> Block:
    """Draw the record and the healthy record over time, on equal axes; `suffix` makes the ids of the figures unique."""
    view, marked = record.view, record.marked
    limit = HEAD_ROOM * max(one.highest for one in view.records)
    period = (f"1/{marked.name}", 1 / marked.kinematic_hz) if marked else None
    inches = HALF if view.healthy else WIDE
    panels = []
    for title, key, one in zip(RECORD_NAMES, ("", "-healthy"), view.records, strict=False):
        plot = acceleration_panel(one, limit=limit, title=title, inches=inches, period=period)
        words: dict[str, Any] = {"id": f"time-figure{key}{suffix}", "badge": one.origin, "title": title}
        panels.append(USER_TEXTS.figure("time", plot, wide=False, heading=title.capitalize(), **words))
    start, stop = view.record.window_s
    same_axes = ", on the same axes" if view.healthy else ""
    bar = f" {USER_TEXTS.text('period', name=marked.name)}" if marked else ""
    return USER_TEXTS.grid("grid-time", panels, window_ms=1e3 * (stop - start), axes=same_axes, period=bar)


def _model(record: UserRecord, model: ModelSide, suffix: str) -> Iterator[Block]:
    """Tabulate fault frequencies of model and record, draw the model's spectrum; `suffix` makes the ids unique."""
    lines, (low_hz, high_hz) = model.lines, model.view.analysis.processed.band_hz
    rows = [_model_row(line, *lines[line.name]) for line in first_lines(record.analysis) if line.name in lines]
    of_dimensions, opened, scene = "", "", f", inputs of scene `{model.base}`"
    if model.open_cage:
        of_dimensions, scene = ", with what the bearing's dimensions leave open of it", ""
        opened = f"{USER_TEXTS.text('open-cage', percent=100 * model.open_cage)} "
    defect = f"a defect of the {model.state.label}" if model.state.line else "no defect"
    load = " and load" if model.stated_load else "; the record states no load, so the load of the scene was used"
    of_model = {"model": model.run.scene.model, "scene": scene, "defect": defect}
    yield USER_TEXTS.paragraph("model", load=load, open_cage=opened, **of_model)
    shaft_hz, name = model.view.shaft_hz, f"model-table{suffix}"
    yield USER_TEXTS.table("model-table", rows, id=name, shaft_hz=shaft_hz, open_cage=of_dimensions)
    view = dataclasses.replace(record.view, record=model.view, healthy=None, peaks=detected_peaks(model.view))
    words: dict[str, Any] = {"low_hz": low_hz, "high_hz": high_hz, "state": model.state.label}
    words |= {"id": f"model-figure{suffix}", "badge": model.view.origin}
    yield USER_TEXTS.figure("model-figure", spectrum_panel(view, title=f"{words['state']}, envelope spectrum"), **words)


def _model_row(line: Line, model_hz: float, model_ci95_pct: float) -> dict[str, Any]:
    """Compare a line of the record with the frequency `model_hz` of the model, known to ± `model_ci95_pct`."""
    found_hz = line.found_hz if line.detected else None
    return vars(line) | {
        "model_hz": model_hz,
        "model_hz_ci95": model_hz * model_ci95_pct / 100 or None,
        "found_hz": found_hz,
        "found_hz_ci95": line.ci95_hz,
        "difference_pct": None if found_hz is None else 100 * (model_hz / found_hz - 1),
        "difference_pct_ci95": None if found_hz is None else math.hypot(line.deviation_ci95_pct or 0.0, model_ci95_pct),
    }
