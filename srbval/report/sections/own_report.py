"""The report on one's own recordings: the answer, spectra, lines, what was not seen, a healthy record, the model."""

import dataclasses
import itertools
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.diagnosis.baseline_comparison import Basis
from srbval.reading.lines import Line
from srbval.reading.shown_record import SEGMENT_HZ, ShownRecord
from srbval.reading.speed_search import USABLE_SHARE
from srbval.recordings import Origin
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Explore, Figure, FigureGrid, Listing
from srbval.report.figures.acceleration import acceleration_panel
from srbval.report.figures.analysis import OWN_UNIT
from srbval.report.figures.band import band_panel
from srbval.report.figures.record_figures import HEAD_ROOM, LABEL_ROOM, highest_shown
from srbval.report.figures.spectrum import envelope_spectrum_panel
from srbval.report.figures.style import HALF, WIDE
from srbval.report.findings.user_records import ModelResult, OwnEvidence, OwnRecord
from srbval.report.model import Report, Section, VerdictBox
from srbval.report.section_texts import Texts
from srbval.report.sections.closing import provenance_section
from srbval.report.sections.names import badge_of
from srbval.signal import LEAST_SNR

TEXTS = Texts("own_report")
BRIEF_SECTIONS = 2
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0


def assemble_own(evidence: OwnEvidence, *, command: str, brief: bool = False) -> Report:
    """Build the report; `command` is the one that makes it again.

    If `brief`, of the first record the envelope spectrum and the table of lines alone.
    """
    records, origin = evidence.records, {"command": command, **evidence.provenance}
    several = len(records) > 1
    if brief:
        sections = list(itertools.islice(_sections(records[0], ""), BRIEF_SECTIONS))
    else:
        table = TEXTS.table("overview-table", records, headline=_headline)
        sections = [_section("overview", "", table)] if several else []
        sections += [s for n, r in enumerate(records, start=1) for s in _sections(r, f"-{n}" if several else "")]
        sections += [_section("limits", "", TEXTS.listing("limits", records=records)), provenance_section(origin)]
    names = [record.analysis.recording.name for record in records]
    verdict = _verdict(records[0]) if not several else _verdict_of_all(records)
    text = " ".join(verdict.headline.replace("**", "").split())
    return Report(
        title=TEXTS.text("title", names=names),
        subtitle=TEXTS.text("subtitle", records=records),
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=tuple(sections),
        data=evidence.to_dict() | {"headline": {"text": text}, "provenance": origin},
    )  # fmt: skip


def _headline(record: OwnRecord) -> str:
    shown = [line for line in record.first_lines if line.detected and Fault.of_line(line.name)]
    return TEXTS.text("headline", call=record.call, Basis=Basis, shown=shown, doubted=record.doubted)


def _verdict(record: OwnRecord) -> VerdictBox:
    marked = record.marked and record.marked.name
    also = [x.name for x in record.first_lines if x.detected and x.name != marked and Fault.of_line(x.name)]
    return VerdictBox(
        tone=_tone(record),
        headline=_headline(record),
        points=TEXTS.listing(
            "points", record=record, analysis=record.analysis, call=record.call, also=also, doubted=record.doubted
        ).items,
    )


def _verdict_of_all(records: tuple[OwnRecord, ...]) -> VerdictBox:
    tones = [_tone(record) for record in records]
    worst = next(tone for tone in (Tone.BAD, Tone.WARNING, Tone.NEUTRAL, Tone.GOOD) if tone in tones)
    called = [record for record in records if record.call.called]
    indicated = [record for record in records if record.call.indicated and not record.call.called]
    words = {"records": records, "called": called, "indicated": indicated}
    return VerdictBox(
        tone=worst,
        headline=TEXTS.text("headline-of-all", **words),
        points=TEXTS.listing("points-of-all", **words).items,
    )


def _tone(record: OwnRecord) -> Tone:
    call = record.call
    if call.called:
        return Tone.BAD
    if call.indicated:
        return Tone.WARNING
    return Tone.GOOD if call.basis in (Basis.BASELINE, Basis.DECLARED_HEALTHY) else Tone.NEUTRAL


def _section(about: str, suffix: str, *blocks: Block, appendix: tuple[Block, ...] = (), **values: Any) -> Section:
    title = TEXTS.text(f"title-{about}", **values)
    return Section(id=about + suffix, title=title, blocks=blocks, appendix=appendix)


def _sections(record: OwnRecord, suffix: str) -> Iterator[Section]:
    """The sections of one record; `suffix` tells its ids from another's."""
    name = record.analysis.recording.name if suffix else ""
    yield _section("spectrum", suffix, *_facts(record, bool(suffix)), _spectrum(record, suffix), name=name)
    further = (_all_lines(record, suffix),)
    yield _section("lines", suffix, _lines(record, suffix), *_unseen(record), appendix=further, name=name)
    yield _section("signal", suffix, _band(record, suffix), *_times(record, suffix), name=name)
    if record.baseline is not None:
        yield _section(
            "baseline", suffix, TEXTS.listing("baseline", record=record, baseline=record.baseline), name=name
        )
    if isinstance(record.model, str):
        yield _section("model", suffix, TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model), name=name)
    elif record.model is not None:
        yield _section("model", suffix, *_model(record, record.model, suffix), name=name)


def _facts(record: OwnRecord, with_answer: bool) -> Iterator[Block]:
    if with_answer:
        verdict = _verdict(record)
        yield TEXTS.callout("answer", tone=verdict.tone, headline=verdict.headline, points=verdict.points)
    yield TEXTS.listing("facts", analysis=record.analysis, recording=record.analysis.recording)


def _spectrum(record: OwnRecord, suffix: str) -> Figure:
    """The envelope spectrum with every line expected in it, a healthy record's dashed."""
    shown, healthy, shaft_hz = record.shown, record.healthy, record.analysis.speed.value_hz
    cursors = record.expected
    plot = partial(
        envelope_spectrum_panel, frequency_hz=shown.frequency_hz, amplitude=shown.amplitude, shaft_hz=shaft_hz,
        origin=record.analysis.recording.origin.value, cursors=cursors,
        peaks=record.peaks,
        healthy=None if healthy is None else (healthy.frequency_hz, healthy.amplitude), f_max_hz=record.spectrum_hz,
        y_limits=(0.0, LABEL_ROOM * _highest(record, (shown, healthy))), title="envelope spectrum",
        y_label=f"Envelope, {record.unit}",
    )  # fmt: skip
    explore = Explore(
        x="frequency_hz", x_label="Frequency, Hz", y_label=f"Envelope, {record.unit}",
        curves={"amplitude": "this record"} | ({} if healthy is None else {"healthy_amplitude": "healthy record"}),
        marks=tuple((cursor.name, cursor.frequency_hz) for cursor in cursors), x_per_order=shaft_hz,
    )  # fmt: skip
    figure = TEXTS.figure(
        "spectrum", plot, id=f"spectrum-figure{suffix}", badge=badge_of(record.analysis), record=record
    )
    return dataclasses.replace(figure, explore=explore)


def _lines(record: OwnRecord, suffix: str) -> Block:
    before = record.baseline and {x.name: x for x in record.baseline.analysis.lines if x.harmonic == 1}
    rows = [
        {"line": x, "fault": Fault.of_line(x.name), "before": before and before.get(x.name)} for x in record.first_lines
    ]
    name = "lines-table" if before is None else "lines-with-healthy"
    table = TEXTS.table(name, rows, record=record, tone=_tone_of)
    return dataclasses.replace(table, id=f"lines-table{suffix}")


def _tone_of(line: Line) -> str:
    return Tone.WARNING.value if line.detected and Fault.of_line(line.name) else Tone.NEUTRAL.value


def _unseen(record: OwnRecord) -> Iterator[Block]:
    if record.unseen:
        low, high = record.analysis.processed.band_hz
        limits = {"reach_hz": USABLE_SHARE * (high - low), "least_snr": LEAST_SNR}
        yield TEXTS.paragraph("unseen-intro")
        yield Listing(tuple(TEXTS.text("unseen", line=line, why=why, **limits) for line, why in record.unseen))


def _band(record: OwnRecord, suffix: str) -> Figure:
    shown, healthy = record.shown, record.healthy
    levels = ({} if healthy is None else {"healthy record": healthy.power_db}) | {"this record": shown.power_db}
    top = max(float(np.nanmax(level)) for level in levels.values()) + BAND_HEAD_DB
    low = min(float(np.nanmin(level)) for level in levels.values()) - BAND_HEAD_DB
    physical = record.unit == OWN_UNIT
    plot = partial(
        band_panel, frequency_hz=shown.power_hz, levels_db=levels,
        origin=record.analysis.recording.origin.value, band_hz=record.analysis.processed.band_hz,
        limits_db=(max(low, top - BAND_RANGE_DB), top), f_max_hz=float(shown.power_hz[-1]),
        y_label="Power density, dB re 1 (m/s²)²/Hz" if physical else "Power density, dB re 1/Hz",
    )  # fmt: skip
    return TEXTS.figure(
        "band",
        plot,
        id=f"band-figure{suffix}",
        badge=badge_of(record.analysis),
        record=record,
        resolution_hz=SEGMENT_HZ,
    )


def _times(record: OwnRecord, suffix: str) -> Iterator[Block]:
    """The record and the healthy one in time, on the same axes."""
    sides = [("this record", record.shown)] + ([] if record.healthy is None else [("healthy record", record.healthy)])
    limit = HEAD_ROOM * max(float(max(np.abs(side.acceleration).max(), side.envelope.max())) for _, side in sides)
    marked = record.marked
    panels = []
    for (title, side), key in zip(sides, ("", "-healthy"), strict=False):
        plot = partial(
            acceleration_panel, time_s=side.time_s, acceleration=side.acceleration, envelope=side.envelope,
            origin=side.analysis.recording.origin.value, window_s=record.window_s, y_limits=(-limit, limit),
            title=title,
            period_s=1 / marked.kinematic_hz if marked else None, period_name=f"1/{marked.name}" if marked else "",
            inches=WIDE if len(sides) == 1 else HALF, y_label=f"Acceleration, {record.unit}",
        )  # fmt: skip
        panels.append(
            TEXTS.figure(
                "time", plot, id=f"time-figure{key}{suffix}", badge=badge_of(side.analysis), record=record, title=title
            )
        )
    yield FigureGrid(figures=tuple(panels), columns=len(panels), caption=TEXTS.text("grid-time", record=record))


def _model(record: OwnRecord, model: ModelResult, suffix: str) -> Iterator[Block]:
    """Where the model's lines lie beside the record's, and its envelope spectrum."""
    shaft_hz, lines = model.analysis.speed.value_hz, model.lines
    rows = [{"line": x, "model": lines[x.name]} for x in record.first_lines if x.name in lines]
    yield TEXTS.paragraph("model", model=model)
    table = TEXTS.table("model-table", rows, shaft_hz=shaft_hz, model=model)
    yield dataclasses.replace(table, id=f"model-table{suffix}")
    shown = model.shown
    plot = partial(
        envelope_spectrum_panel, frequency_hz=shown.frequency_hz, amplitude=shown.amplitude, shaft_hz=shaft_hz,
        origin=Origin.SIMULATED.value, cursors=record.expected, peaks=model.peaks,
        healthy=None, f_max_hz=record.spectrum_hz, y_limits=(0.0, LABEL_ROOM * _highest(record, (shown,))),
        title=f"{model.state.label}, envelope spectrum",
    )  # fmt: skip
    yield TEXTS.figure("model", plot, id=f"model-figure{suffix}", badge=badge_of(model.analysis), model=model)


def _all_lines(record: OwnRecord, suffix: str) -> Block:
    rows = [x for x in record.analysis.lines if x.found_hz is not None]
    table = TEXTS.table("all-lines-table", rows, shaft_hz=record.analysis.speed.value_hz)
    return dataclasses.replace(table, id=f"all-lines-table{suffix}")


def _highest(record: OwnRecord, sides: tuple[ShownRecord | None, ...]) -> float:
    """The highest amplitude shown, above the slow trend at the very start of a spectrum."""
    return max(highest_shown(s.frequency_hz, s.amplitude, record.spectrum_hz) for s in sides if s is not None)
