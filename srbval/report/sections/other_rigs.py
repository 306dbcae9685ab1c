"""What the one pipeline finds in recordings of other rigs, whose faults are known."""

from collections.abc import Iterator, Sequence
from typing import Any

from srbval.bearing import DEFECTS
from srbval.comparison.other_rigs import OtherRecord
from srbval.reading.lines import RACE_LINES
from srbval.recordings import SpeedSource
from srbval.report.blocks import Block, Paragraph, Section, Tone
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import Texts

TEXTS = Texts("other_rigs")
NEAR_PCT = 0.5
GRADES = {True: "graded diagnosable", None: "without a grade", False: "graded partly or not"}


def other_rigs_section(findings: Findings) -> tuple[Section, ...]:
    """The section, or none where no such recording is registered."""
    records = findings.data["other_rigs"]
    if not records:
        return ()
    read = [record for record in records if not record.refused]
    refused = [record for record in records if record.refused]
    names = [findings.datasets[name].title for name in dict.fromkeys(record.dataset for record in records)]
    blocks: list[Block] = [TEXTS.paragraph("intro", records=records, names=names, read=len(read))]
    if read:
        blocks += [TEXTS.table("other-rigs-table", read, tone=_tone), *_summary(read, findings)]
    if refused:
        blocks.append(TEXTS.table("other-rigs-refused", refused))
    return (TEXTS.section(appendix=blocks),)


def _tone(record: OtherRecord) -> Tone:
    """Good where a fault's line is shown and a healthy record shows none."""
    if record.shown == (record.state in DEFECTS):
        return Tone.GOOD
    return Tone.NEUTRAL if record.diagnosable is False else Tone.WARNING


def _summary(read: Sequence[OtherRecord], findings: Findings) -> Iterator[Paragraph]:
    faults = [r for r in read if r.state in DEFECTS and r.line is not None and r.line.name in RACE_LINES]
    healthy = [r for r in read if r.state not in DEFECTS]
    known = [r for r in faults if r.shown and not (r.speed and r.speed.source is SpeedSource.NOMINAL)]
    graded = {d.source for r in read if (d := findings.datasets[r.dataset].diagnosability)}
    yield TEXTS.paragraph(
        "shown",
        groups=list(_groups(faults)),
        healthy=healthy,
        called=sum(r.call is not None and r.call.risen is not None for r in healthy),
    )
    beyond = [r for r in known if r.line and abs(r.line.deviation_pct or 0) > NEAR_PCT]
    yield TEXTS.paragraph("deviations", known=len(known), beyond=beyond, near_pct=NEAR_PCT)
    yield from _slip_by_load(faults, findings)
    yield from TEXTS.paragraphs("baseline", **_baseline(faults))
    yield from TEXTS.paragraphs("grades", sources=sorted(graded))


def _groups(faults: Sequence[OtherRecord]) -> Iterator[dict[str, Any]]:
    """How many of the diagnosable, the ungraded and the other race faults show their line; what is missed."""
    for verdict, name in GRADES.items():
        group = [record for record in faults if record.diagnosable is verdict]
        if group:
            missed = [record.file for record in group if not record.shown]
            yield _group(group, f"race faults {name}") | {"missed": missed}
    plain = [record for record in faults if (record.plain_grade or "").startswith("Y")]
    if plain:
        name = "that the study could diagnose by a plain envelope spectrum, which is what this pipeline uses"
        yield _group(plain, name)


def _group(records: Sequence[OtherRecord], name: str) -> dict[str, Any]:
    return {"name": name, "size": len(records), "shown": sum(record.shown for record in records), "missed": []}


def _slip_by_load(faults: Sequence[OtherRecord], findings: Findings) -> Iterator[Paragraph]:
    """What the race lines of a set that states its loads say of the cage, lightest load first."""
    for name in dict.fromkeys(record.dataset for record in faults):
        loaded = [r for r in faults if r.dataset == name and r.radial_n is not None and r.cage_pct is not None]
        if len({record.radial_n for record in loaded}) > 1:
            loaded.sort(key=lambda record: (record.radial_n or 0.0, record.file))
            yield TEXTS.paragraph("slip-by-load", title=findings.datasets[name].title, loaded=loaded)


def _baseline(faults: Sequence[OtherRecord]) -> dict[str, Any]:
    """What may be called a fault: only what exceeds a healthy record of the same rig, speed and load."""
    held = [r for r in faults if r.call is not None and r.call.baseline is not None]
    return {
        "held": held,
        "alone": sum(r.call is not None and r.call.baseline is None for r in faults),
        "right": sum(r.call is not None and r.call.risen is r.state for r in held),
        "wrong": [r.file for r in held if r.call is not None and r.call.risen not in (None, r.state)],
    }
