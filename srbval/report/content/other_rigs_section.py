"""Recordings of other rigs through the same pipeline: a check of the pipeline, not of the model."""

from __future__ import annotations

from collections.abc import Sequence

from srbval.recordings.datasets.description import dataset
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Paragraph
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.evidence import Evidence
from srbval.validation.other_rigs import LINE_OF, RACES, OtherRecord

DIAGNOSABLE = {True: "yes", False: "no", None: None}


def other_rigs_section(evidence: Evidence) -> tuple[Section, ...]:
    """The section, or none where no such recording is registered."""
    records = evidence.other_rigs
    if not records:
        return ()
    read = [r for r in records if not r.refused]
    blocks: list[Block] = [_intro(records, read)]
    if read:
        blocks += [_table(read), *_summary(read)]
    if len(read) < len(records):
        blocks.append(_refused([r for r in records if r.refused]))
    return (Section(id="other-rigs", title="Other rigs: does the pipeline find known faults?", blocks=tuple(blocks)),)


def _intro(records: Sequence[OtherRecord], read: Sequence[OtherRecord]) -> Paragraph:
    names = ", ".join(dataset(n).title for n in dict.fromkeys(r.dataset for r in records))
    return Paragraph(
        f"{len(records)} recordings of other rigs are registered ({names}); {len(read)} name a bearing whose lines can "
        "be computed. They say nothing of the model; they test the one pipeline on faults that are known."
    )


def _summary(read: Sequence[OtherRecord]) -> list[Paragraph]:
    faults = [r for r in read if r.line in RACES and r.state in LINE_OF and r.diagnosable is not False]
    shown = [r for r in faults if r.shown]
    healthy = [r for r in read if r.state not in LINE_OF]
    wrong = [r for r in healthy if r.shown]
    known = [r for r in shown if r.deviation_pct is not None and r.speed_source != "nominal"]
    beyond = [f"{r.dataset} {r.file} ({r.deviation_pct:+.2f} %)" for r in known if abs(r.deviation_pct or 0) > 0.5]
    sources = {d.source for r in read if (d := dataset(r.dataset).diagnosability)}
    texts = [
        f"Of {len(faults)} race-fault records not called undiagnosable, **{len(shown)} show the right line** and no "
        f"deeper one of the other race; of {len(healthy)} healthy records {len(wrong)} show a line as deep as a "
        "fault's. Where the speed is measured or estimated, "
        f"{len(known) - len(beyond)} of {len(known)} lines lie within 0.5 % of kinematics"
        + (f"; beyond it: {', '.join(beyond)}." if beyond else "."),
    ]
    if sources:
        texts.append(f"Diagnosability: {'; '.join(sorted(sources))}.")
    return [Paragraph(text) for text in texts]


def _table(read: Sequence[OtherRecord]) -> Table:
    return Table(
        id="other-rigs-table",
        label="Other rigs",
        caption="Measured against kinematic lines; for a healthy record its deepest race line.",
        columns=(
            Column(title="Record"),
            Column(title="State"),
            Column(title="Shaft", unit="Hz", format=".3f"),
            Column(title="Line"),
            Column(title="Kinematic", unit="Hz", format=".3f"),
            Column(title="Found", unit="Hz", format=".3f"),
            Column(title="Deviation", unit="%", format="+.3f"),
            Column(title="Over noise", format=",.0f"),
            Column(title="Depth", format=".2f"),
            Column(title="Shown"),
            Column(title="Held diagnosable"),
        ),
        rows=[_row(r) for r in read],
        notes=(
            "**Depth**: the line's amplitude in the squared envelope over its mean. **Shown**: detected and deeper "
            "than the other race's; for a healthy record, a race line as deep as half the mean. **Shaft**: estimated "
            "means read from the record's own fault harmonics and shaft sidebands. A dash at the end: the benchmark "
            "does not speak of the record.",
        ),
    )


def _row(r: OtherRecord) -> list[Cell | Value]:
    healthy = r.state not in LINE_OF
    good = r.shown != healthy
    return [
        Cell(value=r.file, note=r.dataset),
        None if r.state is None else r.state.value,
        Cell(value=r.shaft_hz, ci95=r.shaft_ci95_hz, note=r.speed_source or ""),
        r.line,
        r.kinematic_hz,
        r.found_hz if r.detected else None,
        Cell(value=r.deviation_pct if r.detected else None, ci95=r.deviation_ci95_pct),
        r.snr,
        r.depth,
        Cell(value=r.shown, tone=Tone.GOOD if good else Tone.NEUTRAL if r.diagnosable is False else Tone.WARNING),
        DIAGNOSABLE[r.diagnosable],
    ]


def _refused(refused: Sequence[OtherRecord]) -> Table:
    return Table(
        id="other-rigs-refused",
        label="Not analysed",
        caption="Registered recordings of other rigs that leave something open.",
        columns=(Column(title="Record"), Column(title="Why")),
        rows=[[Cell(value=r.file, note=r.dataset), r.refused] for r in refused],
    )
