"""Report on a user's recordings: verdict, spectra, fault lines, comparison with a healthy record and the model."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import Fault
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import FailedFile
from srbval.reading.lines import Line
from srbval.reading.pipeline import USABLE_SHARE
from srbval.report.blocks import (
    REPORT_SCHEMA,
    Block,
    Figure,
    Heading,
    Listing,
    Report,
    ReportTable,
    Section,
    Tone,
    VerdictBox,
)
from srbval.report.figures.comparison import probabilities_plot
from srbval.report.figures.plot import HEAD_ROOM, SPECTRUM_LABEL_ROOM
from srbval.report.figures.signals import acceleration_panel, band_panel, spectrum_panel
from srbval.report.figures.style import HALF, WIDE
from srbval.report.findings.records import SEGMENT_HZ, detected_peaks, first_lines, make_badge, peak_amplitude
from srbval.report.findings.user_records import ModelSide, UserRecord
from srbval.report.plain import literal
from srbval.report.sections import user_texts
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import explore_spectrum
from srbval.report.sections.user_texts import USER_TEXTS
from srbval.signal import LEAST_SNR

BRIEF_SECTIONS = ("answer", "lines")
HEALTHY_CURVE_NOTE = " Dashed grey: the healthy record."
SPEED_WORDS = {
    "tachometer": "from the tachometer",
    "stated": "as stated",
    "estimated": "estimated from the vibration itself",
    "nominal": "nominal, not measured",
    "prescribed": "prescribed",
}
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
    other_rows: Sequence[Mapping[str, Any]] = (),
    brief: bool = False,
) -> Report:
    """Build the report on a user's recordings; `command` is printed as the command that repeats it.

    Further recordings without a section are given by their JSON documents (`others`) and their rows in the overview
    table (`other_rows`). If `brief`, the report has only the first record's answer, reasons and table of lines.
    """
    origin, several = {"command": command, **provenance}, len(records) + len(others) > 1
    if several:
        summaries = (*(record.summary for record in records), *other_rows)
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
        points, of_one = tuple(user_texts.points_of_one(records[0])), records[0].verdict
        headline, figure = literal(of_one.headline), _spectrum(records[0], "")
        verdict = VerdictBox(tone=FINDING_TONES[of_one.finding], headline=headline, points=points, figure=figure)
        sections = [one for one in _sections(records[0], "") if not brief or one.id in BRIEF_SECTIONS]
    if failed:
        reasons = [str(one.error) if one.file in str(one.error) else f"{one.file}: {one.error}" for one in failed]
        sections.insert(1, _section("failed", Listing(tuple(map(literal, reasons))), open=True))
    if not brief:
        sections += [_section("limits", Listing(tuple(user_texts.limit_items(records)))), provenance_section(origin)]
    first, count = records[0].analysis, len(records) + len(others)
    rpm = f", {60 * first.speed.value_hz:.5g} rpm" if len(records) == 1 else ""
    return Report(
        title=f"Bearing report: {f'{count} recordings' if several else first.recording.name}",
        subtitle=f"{first.bearing.title}{rpm}",
        generated_utc=datetime.now(UTC),
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
    """Make the verdict on several recordings; `bars` are names and probabilities, `failed` counts unreadable files."""
    alarms, shown = {row["alarm"] for row in summaries}, bars[:MAX_PROBABILITY_BARS]
    highest = [(name, max(shares.items(), key=lambda one: one[1])) for name, shares in shown]
    words: dict[str, Any] = {
        "first": f": the first {len(shown)} of {len(bars)}" if len(bars) > len(shown) else "",
        "shown": ", ".join(f"{name} {state} {100 * share:.0f} %" for name, (state, share) in highest),
    }
    return VerdictBox(
        tone=next(tone for alarm, tone in ALARM_TONES.items() if alarm in alarms),
        headline=user_texts.headline_of_all(summaries),
        points=tuple(user_texts.points_of_all(summaries, failed)),
        figure=USER_TEXTS.figure("probabilities", probabilities_plot(shown), **words) if shown else None,
    )


def _section(about: str, *blocks: Block, open: bool = False) -> Section:
    return Section(id=about, title=USER_TEXTS.text(f"title-{about}"), blocks=blocks, open=open)


def _sections(record: UserRecord, suffix: str) -> Iterator[Section]:
    """Make the sections of one record; `suffix` makes the ids of its figures and tables unique."""
    verdict, analysis, recording = record.verdict, record.analysis, record.analysis.recording
    speed, (low_hz, high_hz) = analysis.speed, analysis.processed.band_hz
    given = {name: getattr(recording, name) for name in ("seconds", "fs_hz", "unit")}
    given |= {"file": (recording.file or recording.name).split("/")[-1], "origin": recording.origin.value}
    given["declared"] = f", declared {recording.state.label}" if recording.state else ""
    given["channel"] = f", channel {recording.channel}" if recording.channel else ""
    given |= {"rpm": 60 * speed.value_hz, "rpm_ci95": 60 * speed.ci95_hz, "source": SPEED_WORDS[speed.source.value]}
    given |= {"low_hz": low_hz, "high_hz": high_hz, "why": analysis.band.why, "search": analysis.search}
    reasons = (" ".join(verdict.reasons), verdict.describe_declared(recording.state))
    shown = Listing(tuple(literal(reason) for reason in reasons if reason))
    yield _section("answer", shown, USER_TEXTS.listing("facts", **given))
    yield _section("lines", _lines_table(record, suffix), *_not_detected(record))
    yield _section("signal", _band(record, suffix), _times(record, suffix))
    if record.baseline is not None:
        yield _section("baseline", Listing(tuple(user_texts.baseline_items(record, record.baseline))))
    if isinstance(record.model, str):
        yield _section("model", USER_TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model))
    elif record.model is not None:
        yield _section("model", *_model(record, record.model, suffix))


def _spectrum(record: UserRecord, suffix: str) -> Figure:
    """Draw the envelope spectrum with the expected fault frequencies; `suffix` makes the figure's id unique."""
    view = record.view
    sides = [side for side in (view.record, view.healthy) if side is not None]
    top = SPECTRUM_LABEL_ROOM * max(peak_amplitude(side, view.end_hz) for side in sides)
    plot = spectrum_panel(view, top=top, title="envelope spectrum")
    curves = {"amplitude": "this record"} | ({"healthy_amplitude": "healthy record"} if view.healthy else {})
    marked = record.marked
    sidebands = " and sidebands" if marked and marked.name != "BPFO" else ""
    words: dict[str, Any] = {
        "id": f"spectrum-figure{suffix}",
        "badge": make_badge(record.analysis),
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
        yield Listing(
            tuple(USER_TEXTS.text("unseen", line=line, why=user_texts.unseen_reason(line, **limits)) for line in unseen)
        )


def _band(record: UserRecord, suffix: str) -> Figure:
    view, (low_hz, high_hz) = record.view, record.analysis.processed.band_hz
    records = ({} if view.healthy is None else {"healthy record": view.healthy}) | {"this record": view.record}
    top = max(float(np.nanmax(one.power_db)) for one in records.values()) + BAND_HEAD_DB
    low = min(float(np.nanmin(one.power_db)) for one in records.values()) - BAND_HEAD_DB
    plot = band_panel(records, limits_db=(max(low, top - BAND_RANGE_DB), top), end_hz=float(view.record.power_hz[-1]))
    words: dict[str, Any] = {"low_hz": low_hz, "high_hz": high_hz, "resolution_hz": SEGMENT_HZ}
    words |= {"id": f"band-figure{suffix}", "badge": make_badge(record.analysis)}
    return USER_TEXTS.figure("band", plot, healthy=HEALTHY_CURVE_NOTE if view.healthy else "", **words)


def _times(record: UserRecord, suffix: str) -> Block:
    """Draw the record and the healthy record over time, on equal axes; `suffix` makes the ids of the figures unique."""
    view, marked = record.view, record.marked
    sides = [("this record", "", view.record)]
    if view.healthy is not None:
        sides.append(("healthy record", "-healthy", view.healthy))
    limit = HEAD_ROOM * max(float(max(np.abs(one.acceleration).max(), one.envelope.max())) for *_, one in sides)
    period = (f"1/{marked.name}", 1 / marked.kinematic_hz) if marked else None
    inches = WIDE if len(sides) == 1 else HALF
    panels = []
    for title, key, one in sides:
        plot = acceleration_panel(one, limit=limit, title=title, inches=inches, period=period)
        words: dict[str, Any] = {"id": f"time-figure{key}{suffix}", "badge": make_badge(one.analysis), "title": title}
        panels.append(USER_TEXTS.figure("time", plot, wide=False, heading=title.capitalize(), **words))
    start, stop = view.record.window_s
    same_axes = ", on the same axes" if view.healthy else ""
    bar = f" {USER_TEXTS.text('period', name=marked.name)}" if marked else ""
    return USER_TEXTS.grid("grid-time", panels, window_ms=1e3 * (stop - start), axes=same_axes, period=bar)


def _model(record: UserRecord, model: ModelSide, suffix: str) -> Iterator[Block]:
    """Tabulate fault frequencies of model and record, draw the model's spectrum; `suffix` makes the ids unique."""
    lines, end_hz, (low_hz, high_hz) = model.lines, record.view.end_hz, model.view.analysis.processed.band_hz
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
    title, top = f"{model.state.label}, envelope spectrum", SPECTRUM_LABEL_ROOM * peak_amplitude(model.view, end_hz)
    words: dict[str, Any] = {"low_hz": low_hz, "high_hz": high_hz, "state": model.state.label}
    words |= {"id": f"model-figure{suffix}", "badge": make_badge(model.view.analysis)}
    yield USER_TEXTS.figure("model-figure", spectrum_panel(view, top=top, title=title), **words)


def _model_row(line: Line, model_hz: float, model_ci95_pct: float) -> dict[str, Any]:
    """Compare a fault frequency of the record with the model's [Hz], whose 95 % half width is given in per cent."""
    found_hz = line.found_hz if line.detected else None
    return vars(line) | {
        "model_hz": model_hz,
        "model_hz_ci95": model_hz * model_ci95_pct / 100 or None,
        "found_hz": found_hz,
        "found_hz_ci95": line.ci95_hz,
        "difference_pct": None if found_hz is None else 100 * (model_hz / found_hz - 1),
        "difference_pct_ci95": None if found_hz is None else math.hypot(line.deviation_ci95_pct or 0.0, model_ci95_pct),
    }
