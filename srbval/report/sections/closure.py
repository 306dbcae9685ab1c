"""What the race lines' sum says of speed and slip, and what part of a deviation is either."""

from collections.abc import Iterator

from srbval.report.badges import Tone
from srbval.report.blocks import Block
from srbval.report.findings.findings import Evidence
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("speed_and_slip")
LISTED = 4  # so many measured records are named one by one


def speed_or_slip_section(evidence: Evidence) -> Section:
    """BPFO + BPFI against the number of rollers, and the plain statement; in the appendix what each line says."""
    inner, rollers = evidence.printed.of("inner"), evidence.bearing.rolling_elements
    measured = [r for r in evidence.slips if r.origin == "measured" and r.speed_source == "tachometer"]
    return TEXTS.section(
        TEXTS.paragraph("intro", rollers=rollers),
        TEXTS.table(
            "sum-rule-table",
            evidence.sums,
            rollers=rollers,
            slip_difference=next(s.slip_difference for s in evidence.sums if s.origin == "simulated"),
        ),
        TEXTS.callout(
            "statement",
            tone=Tone.NEUTRAL,
            printed_pct=inner.rig_printed_pct,
            inner_rpm=evidence.printed.shaft_rpm * inner.rig_hz / inner.kinematic_hz,
            rig=next(s for s in evidence.sums if s.source == "paper's rig"),
            measured_sum=next((s for s in evidence.sums if s.origin == "measured"), None),
            measured=measured,
            listed=LISTED,
        ),
        appendix=_each_line(evidence, rollers),
    )


def _each_line(evidence: Evidence, rollers: int) -> Iterator[Block]:
    """Speed and slip of every line, records with both race lines, and the published speeds."""
    nominal = list(dict.fromkeys(row.nominal_rpm for row in evidence.published_speeds))
    speeds = [
        {"state": state} | {row.nominal_rpm: row for row in evidence.published_speeds if row.state is state}
        for state in dict.fromkeys(row.state for row in evidence.published_speeds)
    ]
    yield TEXTS.paragraph("each-line")
    yield TEXTS.table("speed-and-slip-table", evidence.slips)
    for state in evidence.measured_states:
        rig = evidence.rig[state]
        if rig.closure.sum_hz is not None:
            yield TEXTS.paragraph("own-sum", name=rig.recording.name, closure=rig.closure, rollers=rollers)
    yield TEXTS.table("published-speeds", speeds, nominal_rpm=nominal, source=evidence.speed_source)
    inner = next(r for r in evidence.slips if r.origin == "published" and r.line == "BPFI")
    yield TEXTS.paragraph("inner-line", inner=inner, single=evidence.single_speed)
