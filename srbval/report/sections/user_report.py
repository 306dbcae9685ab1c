"""The report on a user's recordings: the answer, spectra, lines, what was not seen, a healthy record, the model."""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import FailedFile
from srbval.reading.lines import Line
from srbval.reading.pipeline import USABLE_SHARE
from srbval.report.blocks import Block, Figure, Listing, Report, Section, Tone, VerdictBox
from srbval.report.figures.plot import HEAD_ROOM, LABEL_ROOM
from srbval.report.figures.signals import acceleration_panel, band_panel, spectrum_panel
from srbval.report.figures.style import HALF, WIDE
from srbval.report.findings.records import SEGMENT_HZ, detected_peaks, first_lines, highest_of
from srbval.report.findings.user_records import ModelSide, UserRecord
from srbval.report.plain import literal
from srbval.report.section_texts import Texts, badge_of
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import explore_spectrum
from srbval.signal import LEAST_SNR

TEXTS = Texts("user_report")
SCHEMA_VERSION = 1
BRIEF_SECTIONS = 2
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

    If `brief`, of the first record the envelope spectrum and the table of lines alone.
    """
    origin, several = {"command": command, **provenance}, len(records) + len(others) > 1
    summaries = (*(record.summary for record in records), *other_rows) if several else ()
    if brief:
        sections = list(itertools.islice(_sections(records[0], ""), BRIEF_SECTIONS))
    else:
        with_channel = len({row["name"] for row in summaries}) < len(summaries)
        table = TEXTS.table("overview-table", summaries, sections=len(records), with_channel=with_channel)
        sections = [_section("overview", "", table)] if several else []
        sections += [s for n, r in enumerate(records, start=1) for s in _sections(r, f"-{n}" if several else "")]
        sections += [_section("limits", "", TEXTS.listing("limits", records=records)), provenance_section(origin)]
    verdict = _verdict_of_all(summaries) if several else _verdict(records[0])
    missing = TEXTS.each("failed", failed)
    verdict = dataclasses.replace(verdict, points=(*missing, *verdict.points))
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
    verdict, recording = record.verdict, record.analysis.recording
    said = [literal(one) for one in (*verdict.reasons, verdict.beside(recording.state)) if one]
    cautions = TEXTS.listing("cautions", cautions=recording.cautions).items
    return VerdictBox(tone=TONES[verdict.finding], headline=literal(verdict.headline), points=(*said, *cautions))


def _verdict_of_all(summaries: Sequence[Mapping[str, Any]]) -> VerdictBox:
    by = {alarm: [row for row in summaries if row["alarm"] == alarm] for alarm in ("yes", "check", "-", "no")}
    tone = next(tone for tone, rows in zip(TONES.values(), by.values(), strict=True) if rows)
    return TEXTS.verdict(tone, "-of-all", records=summaries, by=by)


def _section(about: str, suffix: str, *blocks: Block, appendix: tuple[Block, ...] = (), **values: Any) -> Section:
    title = TEXTS.text(f"title-{about}", **values)
    return Section(id=about + suffix, title=title, blocks=blocks, appendix=appendix)


def _sections(record: UserRecord, suffix: str) -> Iterator[Section]:
    """The sections of one record; `suffix` tells its ids from another's."""
    name = record.analysis.recording.name if suffix else ""
    yield _section("spectrum", suffix, *_facts(record, bool(suffix)), _spectrum(record, suffix), name=name)
    further = (_all_lines(record, suffix),)
    yield _section("lines", suffix, _lines(record, suffix), *_not_detected(record), appendix=further, name=name)
    yield _section("signal", suffix, _band(record, suffix), *_times(record, suffix), name=name)
    if record.baseline is not None:
        yield _section(
            "baseline", suffix, TEXTS.listing("baseline", record=record, baseline=record.baseline), name=name
        )
    if isinstance(record.model, str):
        yield _section("model", suffix, TEXTS.callout("model-failed", tone=Tone.WARNING, why=record.model), name=name)
    elif record.model is not None:
        yield _section("model", suffix, *_model(record, record.model, suffix), name=name)


def _facts(record: UserRecord, with_answer: bool) -> Iterator[Block]:
    if with_answer:
        verdict = _verdict(record)
        yield TEXTS.callout("answer", tone=verdict.tone, headline=verdict.headline, points=verdict.points)
    yield TEXTS.listing("facts", analysis=record.analysis, recording=record.analysis.recording)


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
