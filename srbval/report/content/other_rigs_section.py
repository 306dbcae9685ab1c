"""Recordings of other rigs through the same pipeline: a check of the pipeline, not of the model."""

from __future__ import annotations

from collections.abc import Sequence

from srbval.bearing import DEFECTS
from srbval.evidence.gather import Evidence
from srbval.recordings import SpeedSource
from srbval.recordings.datasets.description import dataset
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Paragraph
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.fault_call import Basis
from srbval.validation.lines import RACE_LINES
from srbval.validation.other_rigs import OtherRecord

NEAR_PCT = 0.5


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
    faults = [r for r in read if r.line is not None and r.line.name in RACE_LINES and r.state in DEFECTS]
    healthy = [r for r in read if r.state not in DEFECTS]
    called = [r for r in healthy if r.call is not None and r.call.called is not None]
    wrong = [r for r in healthy if r.shown]
    graded = {d.source for r in read if (d := dataset(r.dataset).diagnosability)}
    texts = [
        f"**Right line shown** (and no deeper one of the other race): {_shares(faults)}. Of {len(healthy)} healthy "
        f"records {len(wrong)} show a race line like a fault's, and a fault is called on {len(called)}.",
        _deviations([r for r in faults if r.shown and not _nominal(r)]),
        *_slip_by_load(faults),
        *_against_baseline(faults),
    ]
    if graded:
        texts.append(f"Grades: {'; '.join(sorted(graded))}. A record without one was not graded in what could be had.")
    return [Paragraph(text) for text in texts]


def _shares(faults: Sequence[OtherRecord]) -> str:
    """How many of the diagnosable, the ungraded and the other race faults show their line; what is missed."""
    parts = []
    for verdict, name in ((True, "graded diagnosable"), (None, "without a grade"), (False, "graded partly or not")):
        group = [r for r in faults if r.diagnosable is verdict]
        missed = ", ".join(literal(r.file) for r in group if not r.shown)
        if group:
            text = f"{sum(r.shown for r in group)} of {len(group)} race faults {name}"
            parts.append(text + (f" (not {missed})" if missed else ""))
    plain = [r for r in faults if (r.plain_grade or "").startswith("Y")]
    if plain:
        parts.append(
            f"{sum(r.shown for r in plain)} of {len(plain)} that the study could diagnose by a plain envelope "
            "spectrum, which is what this pipeline uses"
        )
    return "; ".join(parts) or "no race fault is registered"


def _against_baseline(faults: Sequence[OtherRecord]) -> list[str]:
    """What may be called a fault: only what stands against a healthy record of the same rig, speed and load."""
    held = [r for r in faults if r.call is not None and r.call.basis is Basis.BASELINE]
    alone = sum(1 for r in faults if r.call is not None and r.call.basis is Basis.LINE_ALONE)
    right = sum(1 for r in held if r.call is not None and r.call.called is r.state)
    wrong = [r for r in held if r.call is not None and r.call.called not in (None, r.state)]
    texts = []
    if held:
        amiss = f", another one on {', '.join(literal(r.file) for r in wrong)}" if wrong else ", a wrong one on none"
        texts.append(
            f"{len(held)} race-fault records have a healthy record of the same rig, speed, load and sampling rate to "
            f"be held against: the right fault is called on {right}{amiss}."
        )
    if alone:
        texts.append(
            f"{alone} race-fault records have none: there a line alone cannot tell a fault from the healthy bearing's "
            "own lines, and no fault is called."
        )
    return [" ".join(texts)] if texts else []


def _nominal(record: OtherRecord) -> bool:
    return record.speed is not None and record.speed.source is SpeedSource.NOMINAL


def _deviations(known: Sequence[OtherRecord]) -> str:
    lines = [(r, r.line) for r in known if r.line is not None and abs(r.line.deviation_pct or 0) > NEAR_PCT]
    beyond = [record for record, _ in lines]
    listed = ", ".join(
        f"{literal(r.file)} ({line.deviation_pct:+.2f} ± {line.deviation_ci95_pct:.2f} %)" for r, line in lines
    )
    return (
        f"Where the speed is measured or estimated, {len(known) - len(beyond)} of {len(known)} shown lines lie within "
        f"{NEAR_PCT:g} % of kinematics"
        + (f"; beyond it: {listed}." if beyond else ".")
        + "".join(f" {literal(r.file)}: {r.caution}." for r in beyond if r.caution)
    )


def _slip_by_load(faults: Sequence[OtherRecord]) -> list[str]:
    """What the race lines of a set that states its loads say of the cage, lightest load first."""
    texts = []
    for name in dict.fromkeys(r.dataset for r in faults):
        loaded = [r for r in faults if r.dataset == name and r.radial_n is not None and r.cage_pct is not None]
        loaded.sort(key=lambda r: (r.radial_n or 0.0, r.file))
        if len({r.radial_n for r in loaded}) > 1:
            said = ", ".join(
                f"{r.cage_pct:+.2f} ± {r.cage_ci95_pct:.2f} % at {r.radial_n:.0f} N ({r.line and r.line.name})"
                for r in loaded
            )
            texts.append(
                f"{dataset(name).title}: its radial loads are stated, and each line by itself gives the cage's "
                f"deviation from kinematics: {said}. BPFI above and BPFO below kinematics at a record's own speed "
                "mean a slipping cage, which a light load allows; a wrong speed would move both lines the same way."
            )
    return texts


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
            Column(title="Grade"),
        ),
        rows=[_row(r) for r in read],
        notes=(
            "**Depth**: the line's amplitude in the squared envelope over its mean. **Shown**: detected and deeper "
            "than the other race's; for a healthy record, a race line half as deep as the mean and more, on the outer "
            "race with a second harmonic of a third of it. **Shaft**: estimated means read from the record's own fault "
            "harmonics and shaft sidebands. **Grade**: of the published study; Y diagnosable, P partly, N not; none "
            "where it is not known; by a plain envelope alone in brackets.",
        ),
    )


def _row(r: OtherRecord) -> list[Cell | Value]:
    line, speed = r.line, r.speed
    assert line is not None, "only records that were read have a row"
    assert speed is not None, "only records that were read have a row"
    healthy = r.state not in DEFECTS
    good = r.shown != healthy
    return [
        Cell(value=r.file, note=r.dataset),
        None if r.state is None else r.state.value,
        Cell(value=speed.value_hz, ci95=speed.ci95_hz, note=speed.source.value),
        line.name,
        line.kinematic_hz,
        line.found_hz if line.detected else None,
        Cell(value=line.detected_deviation_pct, ci95=line.deviation_ci95_pct),
        line.snr,
        line.depth,
        Cell(value=r.shown, tone=Tone.GOOD if good else Tone.NEUTRAL if r.diagnosable is False else Tone.WARNING),
        _grades(r),
    ]


def _grades(r: OtherRecord) -> str | None:
    differs = r.grade is not None and r.plain_grade not in (None, r.grade)
    return f"{r.grade} (plain {r.plain_grade})" if differs else r.grade


def _refused(refused: Sequence[OtherRecord]) -> Table:
    return Table(
        id="other-rigs-refused",
        label="Not analysed",
        caption="Registered recordings of other rigs that leave something open.",
        columns=(Column(title="Record"), Column(title="Why")),
        rows=[[Cell(value=r.file, note=r.dataset), r.refused] for r in refused],
    )
