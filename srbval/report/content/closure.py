"""What the race lines' sum says of speed and slip, and what part of a deviation is either."""

from srbval.evidence.evidence import Evidence
from srbval.report.badges import Tone
from srbval.report.model import Section
from srbval.report.section_texts import Texts

SUM_RULE, SPEED_AND_SLIP = Texts("sum_rule"), Texts("speed_and_slip")
LISTED = 4  # so many measured records are named one by one
NO_SLIP_PCT = 0.5  # half of the 1 % in question


def sum_rule_section(evidence: Evidence) -> Section:
    """BPFO + BPFI against the number of rollers, and what follows for the paper's reading of its -1 %."""
    inner = evidence.printed.of("inner")
    table = SUM_RULE.table(
        "sum-rule-table",
        evidence.sums,
        rollers=evidence.bearing.rolling_elements,
        slip_difference=next(s.slip_difference for s in evidence.sums if s.origin == "simulated"),
    )
    return SUM_RULE.section(
        table,
        *SUM_RULE.paragraphs(
            "slip", "measured",
            rig=next(s for s in evidence.sums if s.source == "paper's rig"),
            inner_rpm=evidence.printed.shaft_rpm * inner.rig_hz / inner.kinematic_hz,
            measured=next((s for s in evidence.sums if s.origin == "measured"), None),
        ),
    )  # fmt: skip


def speed_and_slip_section(evidence: Evidence) -> Section:
    """Both tables, the published speeds, and the plain statement."""
    nominal = list(dict.fromkeys(row.nominal_rpm for row in evidence.published_speeds))
    speeds = [
        {"state": state} | {row.nominal_rpm: row for row in evidence.published_speeds if row.state is state}
        for state in dict.fromkeys(row.state for row in evidence.published_speeds)
    ]
    measured = [r for r in evidence.slips if r.origin == "measured" and r.speed_source == "tachometer"]
    return SPEED_AND_SLIP.section(
        SPEED_AND_SLIP.paragraph("intro"),
        SPEED_AND_SLIP.table("speed-and-slip-table", evidence.slips),
        *(
            SPEED_AND_SLIP.paragraph(
                "own-sum",
                name=evidence.rig[state].recording.name,
                closure=evidence.rig[state].closure,
                rollers=evidence.bearing.rolling_elements,
            )
            for state in evidence.measured_states
            if evidence.rig[state].closure.sum_hz is not None
        ),
        SPEED_AND_SLIP.table("published-speeds", speeds, nominal_rpm=nominal, source=evidence.speed_source),
        SPEED_AND_SLIP.callout(
            "statement",
            tone=Tone.NEUTRAL,
            printed_pct=evidence.printed.of("inner").rig_printed_pct,
            inner=next(r for r in evidence.slips if r.origin == "published" and r.line == "BPFI"),
            single=evidence.single_speed,
            measured=measured,
            listed=LISTED,
            no_slip=all(abs(r.slip_pct) + r.slip_ci95_pct < NO_SLIP_PCT for r in measured),
        ),
    )
