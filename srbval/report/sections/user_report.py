"""The report on a user's recordings: the answer, spectra, lines, what was not seen, a healthy record, the model."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import FailedFile
from srbval.reading.lines import Line
from srbval.reading.pipeline import USABLE_SHARE
from srbval.report.blocks import Block, Figure, Heading, Listing, Report, Section, Tone, VerdictBox
from srbval.report.figures.comparison import probabilities_plot
from srbval.report.figures.plot import HEAD_ROOM, LABEL_ROOM
from srbval.report.figures.signals import acceleration_panel, band_panel, spectrum_panel
from srbval.report.figures.style import HALF, WIDE
from srbval.report.findings.records import SEGMENT_HZ, detected_peaks, first_lines, highest_of
from srbval.report.findings.user_records import ModelSide, UserRecord
from srbval.report.section_texts import Texts, badge_of
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import explore_spectrum
from srbval.signal import LEAST_SNR

TEXTS = Texts("user_report")
SCHEMA_VERSION = 1
BRIEF = ("answer", "lines")
MOST_BARS = 12  # recordings in the picture of all, which leaves room for the points on the first screen
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0
TONES = {
    Finding.NAMED: Tone.BAD, Finding.UNDECIDED: Tone.WARNING, None: Tone.NEUTRAL, Finding.NOTHING_FOUND: Tone.GOOD,
}  # fmt: skip


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
    """Build the report; `command` is the one that makes it again, `failed` what it lacks.

    `others` are the documents of records that have a row here and no section, `other_rows` these rows (`summary_of`).

    If `brief`, of the first record the answer, what it rests on and the table of lines alone.
    """
    origin, several = {"command": command, **provenance}, len(records) + len(others) > 1
    if several:
        summaries = (*(record.summary for record in records), *other_rows)
        faults = [*(record.verdict.to_dict() for record in records), *(one["fault"] for one in others)]
        with_channel = len({row["name"] for row in summaries}) < len(summaries)
        names = [f"{row['name']} {row['channel'] or ''}" if with_channel else row["name"] for row in summaries]
        bars = [(name, one["probabilities"]) for name, one in zip(names, faults, strict=True) if one["probabilities"]]
        verdict = _verdict_of_all(summaries, bars, len(failed))
        table = TEXTS.table("overview-table", summaries, sections=len(records), with_channel=with_channel)
        sections = [_section("overview", table, open=True)]
        sections += [
            _of_record(record, number, f"{name}: {row['state']}")
            for number, (record, name, row) in enumerate(zip(records, names, summaries, strict=False), start=1)
        ]
    else:
        verdict = _verdict(records[0])
        sections = [one for one in _sections(records[0], "") if not brief or one.id in BRIEF]
    if failed:
        sections.insert(1, _section("failed", Listing(TEXTS.each("failed", failed)), open=True))
    if not brief:
        sections += [_section("limits", TEXTS.listing("limits", records=records)), provenance_section(origin)]
    text = " ".join(verdict.headline.replace("**", "").split())
    return Report(
        title=TEXTS.text("title", names=[r.analysis.recording.name for r in records], more=len(others)),
        subtitle=TEXTS.text("subtitle", records=records),
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=tuple(sections),
        data={
            "schema_version": SCHEMA_VERSION, "status": "incomplete" if failed else "ok", "headline": {"text": text},
            "bearing": records[0].analysis.bearing, "records": (*records, *others),
            "failed": tuple(failed), "provenance": origin,
        },
    )  # fmt: skip


def _verdict(record: UserRecord) -> VerdictBox:
    verdict = record.verdict
    values = {"verdict": verdict, "recording": record.analysis.recording, "summary": record.analysis.summary}
    return TEXTS.verdict(TONES[verdict.finding], "-of-one", figure=_spectrum(record, ""), **values)


def _verdict_of_all(
    summaries: Sequence[Mapping[str, Any]], bars: Sequence[tuple[str, Mapping[str, float]]], failed: int
) -> VerdictBox:
    """Of all `summaries`; `bars` are names and probabilities of those that are measured."""
    by = {alarm: [row for row in summaries if row["alarm"] == alarm] for alarm in ("yes", "check", "-", "no")}
    tone = next(tone for tone, rows in zip(TONES.values(), by.values(), strict=True) if rows)
    shown = bars[:MOST_BARS]
    figure = TEXTS.figure("probabilities", probabilities_plot(shown), shown=shown, bars=bars) if shown else None
    return TEXTS.verdict(tone, "-of-all", figure=figure, records=summaries, by=by, failed=failed)


def _section(about: str, *blocks: Block, appendix: tuple[Block, ...] = (), open: bool = False) -> Section:
    return Section(id=about, title=TEXTS.text(f"title-{about}"), blocks=blocks, appendix=appendix, open=open)


def _of_record(record: UserRecord, number: int, title: str) -> Section:
    """One section for one of several records, its parts with headings of their own."""
    suffix = f"-{number}"
    parts = list(_sections(record, suffix))
    blocks = [block for part in parts for block in (Heading(part.title), *part.blocks)]
    return Section(
        id=f"record{suffix}", title=title,
        blocks=(_spectrum(record, suffix), *blocks), appendix=tuple(block for part in parts for block in part.appendix),
    )  # fmt: skip


def _sections(record: UserRecord, suffix: str) -> Iterator[Section]:
    """The sections of one record; `suffix` tells the ids of its figures and tables from another's."""
    recording = record.analysis.recording
    reasons = TEXTS.listing("reasons", verdict=record.verdict, recording=recording)
    yield _section("answer", reasons, TEXTS.listing("facts", analysis=record.analysis, recording=recording))
    further = (_all_lines(record, suffix),)
    yield _section("lines", _lines(record, suffix), *_not_detected(record), appendix=further)
    yield _section("signal", _band(record, suffix), *_times(record, suffix))
    if record.baseline is not None:
        yield _section("baseline", TEXTS.listing("baseline", record=record, baseline=record.baseline))
    if isinstance(record.model, str):
        yield _section("model", TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model))
    elif record.model is not None:
        yield _section("model", *_model(record, record.model, suffix))


def _spectrum(record: UserRecord, suffix: str) -> Figure:
    """The envelope spectrum with every line expected in it, a healthy record's dashed."""
    view = record.view
    sides = [side for side in (view.record, view.healthy) if side is not None]
    top = LABEL_ROOM * max(highest_of(side, view.end_hz) for side in sides)
    plot = spectrum_panel(view, top=top, title="envelope spectrum")
    curves = {"amplitude": "this record"} | ({"healthy_amplitude": "healthy record"} if view.healthy else {})
    explore = explore_spectrum(view, f"Envelope, {view.record.unit}", curves)
    return TEXTS.figure(
        "spectrum", plot, id=f"spectrum-figure{suffix}", badge=badge_of(record.analysis), explore=explore, record=record
    )


def _lines(record: UserRecord, suffix: str) -> Block:
    before = record.baseline and {x.name: x for x in record.baseline.analysis.lines if x.harmonic == 1}
    rows = [
        {"line": x, "fault": Fault.of_line(x.name), "before": before and before.get(x.name)}
        for x in first_lines(record.analysis)
    ]
    name = "lines-table" if before is None else "lines-with-healthy"

    def tone(line: Line) -> Tone:
        return Tone.WARNING if line.detected and Fault.of_line(line.name) else Tone.NEUTRAL

    return TEXTS.table(name, rows, id=f"lines-table{suffix}", record=record, tone=tone)


def _not_detected(record: UserRecord) -> Iterator[Block]:
    if unseen := [line for line in first_lines(record.analysis) if not line.detected]:
        low, high = record.analysis.processed.band_hz
        limits = {"reach_hz": USABLE_SHARE * (high - low), "least_snr": LEAST_SNR}
        yield TEXTS.paragraph("unseen-intro")
        yield Listing(tuple(TEXTS.text("unseen", line=line, why=line.not_detected, **limits) for line in unseen))


def _band(record: UserRecord, suffix: str) -> Figure:
    view = record.view
    records = ({} if view.healthy is None else {"healthy record": view.healthy}) | {"this record": view.record}
    top = max(float(np.nanmax(one.power_db)) for one in records.values()) + BAND_HEAD_DB
    low = min(float(np.nanmin(one.power_db)) for one in records.values()) - BAND_HEAD_DB
    plot = band_panel(records, limits_db=(max(low, top - BAND_RANGE_DB), top), end_hz=float(view.record.power_hz[-1]))
    return TEXTS.figure(
        "band", plot, id=f"band-figure{suffix}", badge=badge_of(record.analysis), record=record,
        resolution_hz=SEGMENT_HZ,
    )  # fmt: skip


def _times(record: UserRecord, suffix: str) -> Iterator[Block]:
    """The record and the healthy one in time, on the same axes."""
    view, marked = record.view, record.marked
    sides = [("this record", "", view.record)]
    if view.healthy is not None:
        sides.append(("healthy record", "-healthy", view.healthy))
    limit = HEAD_ROOM * max(float(max(np.abs(one.acceleration).max(), one.envelope.max())) for *_, one in sides)
    panels = []
    for title, key, one in sides:
        plot = acceleration_panel(one, limit=limit, title=title, inches=WIDE if len(sides) == 1 else HALF,
            period=(f"1/{marked.name}", 1 / marked.kinematic_hz) if marked else None,
        )  # fmt: skip
        name = f"time-figure{key}{suffix}"
        panels.append(TEXTS.figure("time", plot, id=name, badge=badge_of(one.analysis), record=record, title=title))
    yield TEXTS.grid("grid-time", panels, columns=len(panels), record=record)


def _model(record: UserRecord, model: ModelSide, suffix: str) -> Iterator[Block]:
    """Where the model's lines lie beside the record's, and its envelope spectrum."""
    lines, end_hz = model.lines, record.view.end_hz
    rows = [{"line": x, "model": lines[x.name]} for x in first_lines(record.analysis) if x.name in lines]
    yield TEXTS.paragraph("model", model=model)
    yield TEXTS.table("model-table", rows, id=f"model-table{suffix}", shaft_hz=model.view.shaft_hz, model=model)
    view = dataclasses.replace(record.view, record=model.view, healthy=None, peaks=detected_peaks(model.view))
    plot = spectrum_panel(view, top=LABEL_ROOM * highest_of(model.view, end_hz),
        title=f"{model.state.label}, envelope spectrum",
    )  # fmt: skip
    yield TEXTS.figure("model", plot, id=f"model-figure{suffix}", badge=badge_of(model.view.analysis), model=model)


def _all_lines(record: UserRecord, suffix: str) -> Block:
    rows = [x for x in record.analysis.lines if x.found_hz is not None]
    shaft_hz = record.analysis.speed.value_hz
    return TEXTS.table("all-lines-table", rows, id=f"all-lines-table{suffix}", shaft_hz=shaft_hz)
