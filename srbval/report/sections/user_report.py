"""Report on a user's recordings: verdict, spectra, fault lines, comparison with a healthy record and the model."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from srbval.bearing import Fault
from srbval.comparison.counterpart import AnalysedRun
from srbval.diagnosis.baseline import Baseline
from srbval.diagnosis.fault_posterior import LABELS
from srbval.monitoring.batch import FailedFile
from srbval.reading.lines import Line, NotDetected
from srbval.reading.pipeline import USABLE_SHARE
from srbval.recordings import SpeedSource
from srbval.report.blocks import REPORT_SCHEMA, Block, Figure, Heading, Listing, Report, Section, Tone, VerdictBox
from srbval.report.figures.signals import draw_acceleration, draw_band, draw_spectrum
from srbval.report.figures.style import HALF, WIDE, Panel
from srbval.report.findings.records import SEGMENT_HZ, detected_peaks, first_lines, record_view
from srbval.report.findings.user_records import OPEN_CAGE, UserRecord, base_scene, compare_with_model, summary_rows
from srbval.report.prose import Prose, literal
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.case import frequency_table
from srbval.report.sections.figures import HEAD_ROOM, explore_spectrum
from srbval.signal import LEAST_SNR

USER_TEXTS = Prose("srbval.report", "texts/user_report.md")
MIN_PROBABILITY = 0.005  # probabilities below this one are not listed
RECORD_NAMES = ("this record", "healthy record")
HEALTHY_CURVE_NOTE = " Dashed grey: the healthy record."
ALARM_TONES = {"yes": Tone.BAD, "check": Tone.WARNING, "-": Tone.NEUTRAL, "no": Tone.GOOD}  # the worst first


def assemble_user_report(
    records: Sequence[UserRecord],
    *,
    origin: Mapping[str, Any],
    failed: Sequence[FailedFile] = (),
    others: Sequence[Mapping[str, Any]] = (),
) -> Report:
    """Build the report on a user's recordings; `origin` is its provenance and the command that repeats it.

    `others` are JSON documents of recordings without a section.
    """
    first = records[0].analysis
    summaries = summary_rows(records, others)
    with_channel = len({row["name"] for row in summaries}) < len(summaries)
    names = [f"{row['name']} {row['channel'] or ''}" if with_channel else row["name"] for row in summaries]
    alarms, rank = [row["alarm"] for row in summaries], list(ALARM_TONES).index
    worst = min(range(len(records)), key=lambda place: rank(alarms[place]))
    if len(summaries) == 1:
        title, headline, points = names[0], literal(records[0].verdict.headline), tuple(points_of_one(records[0]))
        sections = list(_sections(records[0], "-1"))
    else:
        title, headline, points = f"{len(summaries)} recordings", headline_of_all(alarms), ()
        frame = pd.DataFrame(summaries).assign(recording=names)
        percent, tones = 100 * frame["probability"].astype(float), frame["alarm"].map(ALARM_TONES)
        shown = frame.assign(probability=percent, state_tone=tones)
        sections = [_section("overview", USER_TEXTS.table("overview-table", shown, sections=len(records)), open=True)]
        for place, (record, name, row) in enumerate(zip(records, names, summaries, strict=False)):
            suffix = f"-{place + 1}"
            spectrum = [] if place == worst else [_spectrum(record, name, suffix)]
            parts = [block for one in _sections(record, suffix) for block in (Heading(one.title), *one.blocks)]
            sections.append(Section(id=f"record{suffix}", title=f"{name}: {row['state']}", blocks=(*spectrum, *parts)))
    figure, tone = _spectrum(records[worst], names[worst], f"-{worst + 1}"), ALARM_TONES[min(alarms, key=rank)]
    verdict = VerdictBox(tone=tone, headline=headline, points=points, figure=figure)
    if failed:
        reasons = [str(one.error) if one.file in str(one.error) else f"{one.file}: {one.error}" for one in failed]
        sections.insert(1, _section("failed", Listing(tuple(map(literal, reasons))), open=True))
    sections += [_section("limits", Listing(tuple(limit_items(records)))), provenance_section(origin)]
    return Report(
        title=f"Bearing report: {title}",
        subtitle=first.bearing.title,
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
    )


def headline_of_all(alarms: Sequence[str]) -> str:
    """State how many of several recordings have a named fault, are undecided, or show no fault, from their `alarms`."""
    named, undecided, clear = (alarms.count(alarm) for alarm in ("yes", "check", "no"))
    name = "named" if named else "check" if undecided else "nothing" if clear else "none"
    counts = {"records": len(alarms), "named": named, "undecided": undecided, "clear": clear}
    return USER_TEXTS.text(f"headline-{name}", **counts) + (f"; {undecided} undecided" if named and undecided else "")


def points_of_one(record: UserRecord) -> Iterator[str]:
    """List the points on one recording: comparison with the healthy record, summary, probabilities, and cautions."""
    verdict, analysis = record.verdict, record.analysis
    if first := verdict.comparison.sentence or (verdict.reasons[0] if verdict.diagnosis else ""):
        yield literal(first)
    yield literal(analysis.summary)
    shares = verdict.diagnosis.probabilities if verdict.diagnosis else {}
    ordered = sorted(((name, share) for name, share in shares.items() if share >= MIN_PROBABILITY), key=lambda x: -x[1])
    listed = ", ".join(f"{LABELS[name]} {100 * share:.0f} %" for name, share in ordered)
    parts = [f"Probabilities: {listed}."] if listed else []
    parts += [USER_TEXTS.text("caution", caution=caution) for caution in analysis.recording.cautions]
    if parts:
        yield " ".join(parts)


def unseen_reason(line: Line, **limits: float) -> str:
    """State why a line is not detected; `limits` are the highest usable frequency and the lowest detectable SNR."""
    why = line.not_detected or NotDetected.OWN
    return USER_TEXTS.text(why.name.lower().replace("_", "-"), line=line, **limits)


def baseline_items(record: UserRecord, baseline: Baseline) -> Iterator[str]:
    """Name the healthy record used for comparison, the result, and the reasons to doubt the comparison."""
    yield USER_TEXTS.text("healthy", name=baseline.analysis.recording.name)
    if record.verdict.comparison.sentence:
        yield literal(record.verdict.comparison.sentence)
    if not baseline.conditions:
        yield USER_TEXTS.text("same-conditions")
    yield from (literal(f"{remark[0].upper()}{remark[1:]}.") for remark in baseline.remarks)
    yield from (USER_TEXTS.text("caution", caution=caution) for caution in baseline.analysis.recording.cautions)


def limit_items(records: Sequence[UserRecord]) -> Iterator[str]:
    """List the limitations of the report on these records."""
    yield from USER_TEXTS.items("limits")
    if not any(record.baseline for record in records):
        yield USER_TEXTS.text("no-healthy")
    if any(record.analysis.band.trials > 1 for record in records):
        yield USER_TEXTS.text("band-chosen")
    if any(record.analysis.speed.source is SpeedSource.NOMINAL for record in records):
        yield USER_TEXTS.text("nominal-speed")


def _section(about: str, *blocks: Block, open: bool = False) -> Section:
    return Section(id=about, title=USER_TEXTS.text(f"title-{about}"), blocks=blocks, open=open)


def _sections(record: UserRecord, suffix: str) -> Iterator[Section]:
    """Make the sections of one record; `suffix` makes the ids of its figures and tables unique."""
    verdict, analysis, recording = record.verdict, record.analysis, record.analysis.recording
    speed, (low_hz, high_hz) = analysis.speed, analysis.processed.band_hz
    given: dict[str, Any] = {"file": (recording.file or recording.name).split("/")[-1], "recording": recording}
    given["declared"] = f", declared {recording.state.label}" if recording.state else ""
    given["channel"] = f", channel {recording.channel}" if recording.channel else ""
    given |= {"rpm": 60 * speed.value_hz, "rpm_ci95": 60 * speed.ci95_hz, "low_hz": low_hz, "high_hz": high_hz}
    given |= {"source": USER_TEXTS.text(f"speed-{speed.source.value}"), "analysis": analysis}
    reasons = (" ".join(verdict.reasons), verdict.describe_declared(recording.state))
    shown = Listing(tuple(literal(reason) for reason in reasons if reason))
    yield _section("answer", shown, Listing(USER_TEXTS.items("facts", **given)))
    yield _section("lines", *_line_blocks(record, suffix))
    yield _section("signal", _band(record, suffix), _times(record, suffix))
    if record.baseline is not None:
        yield _section("baseline", Listing(tuple(baseline_items(record, record.baseline))))
    if isinstance(record.model, str):
        yield _section("model", USER_TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model))
    elif record.model is not None:
        yield _section("model", *_model(record, record.model, suffix))


def _spectrum(record: UserRecord, name: str, suffix: str) -> Figure:
    """Draw the envelope spectrum of the record called `name`, with the expected lines; `suffix` makes its id unique."""
    view, marked = record.view, record.marked
    sidebands = " and sidebands" if marked and marked.name != "BPFO" else ""
    return USER_TEXTS.figure(
        "spectrum",
        Panel(draw_spectrum, view, title="envelope spectrum"),
        id=f"spectrum-figure{suffix}",
        label=name,
        badge=view.record.origin,
        explore=explore_spectrum(view),
        marked=f", with harmonics{sidebands} of {marked.name}" if marked else "",
        healthy=HEALTHY_CURVE_NOTE if view.healthy else "",
        end_hz=view.end_hz,
        detected=", ".join(dict.fromkeys(name for name, *_ in view.record.peaks)) or "none",
    )


def _line_blocks(record: UserRecord, suffix: str) -> Iterator[Block]:
    """Tabulate the lines of the bearing, and list the reasons why some are not detected."""
    lines, before = first_lines(record.analysis), dict[str, float | None]()
    columns = USER_TEXTS.columns("lines-table")
    if record.baseline is None:
        del columns["healthy_pct"]
    else:
        before = {one.name: one.depth for one in first_lines(record.baseline.analysis)}
    rows = [_line_row(line, before.get(line.name)) for line in lines]
    yield USER_TEXTS.table("lines-table", rows, columns, id=f"lines-table{suffix}")
    if unseen := [line for line in lines if not line.detected]:
        low, high = record.analysis.processed.band_hz
        limits = {"reach_hz": USABLE_SHARE * (high - low), "least_snr": LEAST_SNR}
        yield USER_TEXTS.paragraph("unseen-intro")
        yield Listing(tuple(USER_TEXTS.text("unseen", line=line, why=unseen_reason(line, **limits)) for line in unseen))


def _line_row(line: Line, healthy_depth: float | None) -> dict[str, Any]:
    fault, shown = Fault.of_line(line.name), line.stated()
    return vars(shown) | {
        "part": fault.label if fault else "cage",
        "found_hz_ci95": line.ci95_hz,
        "deviation_pct_ci95": line.deviation_ci95_pct,
        "depth_pct": None if line.depth is None else 100 * line.depth,
        "healthy_pct": None if healthy_depth is None else 100 * healthy_depth,
        "false_alarm": line.false_alarm,
        "seen": "yes" if line.detected else "no",
        "seen_tone": Tone.WARNING if line.detected and fault else Tone.NEUTRAL,
    }


def _band(record: UserRecord, suffix: str) -> Figure:
    view, (low_hz, high_hz) = record.view, record.analysis.processed.band_hz
    named = dict(zip(RECORD_NAMES, view.records, strict=False))
    plot = Panel(draw_band, dict(reversed(named.items())))  # the healthy record first
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
        plot = Panel(draw_acceleration, one, limit=limit, title=title, inches=inches, period=period)
        words: dict[str, Any] = {"id": f"time-figure{key}{suffix}", "badge": one.origin, "title": title}
        panels.append(USER_TEXTS.figure("time", plot, wide=False, heading=title.capitalize(), **words))
    start, stop = view.record.window_s
    same_axes = ", on the same axes" if view.healthy else ""
    bar = f" {USER_TEXTS.text('period', name=marked.name)}" if marked else ""
    return USER_TEXTS.grid("grid-time", panels, window_ms=1e3 * (stop - start), axes=same_axes, period=bar)


def _model(record: UserRecord, model: AnalysedRun, suffix: str) -> Iterator[Block]:
    """Compare the lines of model and record as a validation does, and draw the model's envelope spectrum."""
    bearing, (low_hz, high_hz) = record.analysis.bearing, model.analysis.processed.band_hz
    state = model.state
    scene = f", inputs of scene `{base_scene(bearing)}`" if bearing.geometry else ""
    opened = "" if bearing.geometry else f"{USER_TEXTS.text('open-cage', percent=100 * OPEN_CAGE)} "
    defect = f"a defect of the {state.label}" if state.line else "no defect"
    stated = record.analysis.recording.radial_n is not None
    load = " and load" if stated else "; the record states no load, so the load of the scene was used"
    words: dict[str, Any] = {"model": model.run.scene.model, "scene": scene, "defect": defect}
    yield USER_TEXTS.paragraph("model", load=load, open_cage=opened, **words)
    if (table := compare_with_model(record.analysis, model)) is not None:
        yield frequency_table(table, id=f"model-table{suffix}")
    own = record_view(model.analysis)
    view = dataclasses.replace(record.view, record=own, healthy=None, peaks=detected_peaks(own))
    words = {"low_hz": low_hz, "high_hz": high_hz, "state": state.label}
    words |= {"id": f"model-figure{suffix}", "badge": own.origin}
    plot = Panel(draw_spectrum, view, title=f"{state.label}, envelope spectrum")
    yield USER_TEXTS.figure("model-figure", plot, **words)
