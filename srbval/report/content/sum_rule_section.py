"""BPFO + BPFI against the number of rollers: what it says of speed and slip."""

from __future__ import annotations

from srbval.evidence.gather import Evidence
from srbval.report.badges import Badge
from srbval.report.blocks import Paragraph
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table


def sum_rule_section(evidence: Evidence) -> Section:
    """The table of sums and what follows for the paper's reading of its -1 %."""
    rollers = evidence.bearing.rolling_elements
    table = Table(
        id="sum-rule-table",
        label="Sum rule",
        caption=f"BPFO + BPFI = {rollers} shaft orders, whatever the slip. The implied speed is the one that "
        "would make a pair add up.",
        columns=(
            Column(title="Pair"),
            Column(title="BPFO", unit="order", format=".4f"),
            Column(title="BPFI", unit="order", format=".4f"),
            Column(title="Sum", unit="order", format=".4f"),
            Column(title=f"From {rollers}", unit="%", format="+.3f"),
            Column(title="Stated speed", unit="rpm", format=".2f"),
            Column(title="Implied speed", unit="rpm", format=".2f"),
            Column(title="Closed"),
        ),
        rows=[
            [
                Cell(value=s.source, badge=Badge(s.origin)),
                s.bpfo_order,
                s.bpfi_order,
                Cell(value=s.total, ci95=s.ci95),
                s.difference_pct,
                s.stated_rpm,
                s.implied_rpm,
                "no uncertainty stated" if s.closed is None else s.closed,
            ]
            for s in evidence.sums
        ],
        notes=(
            "**Closed**: the sum agrees within its 95 % interval. Each pair is read from two records, so what the "
            "cage slips "
            "more in one than in the other stays in the sum; for our two runs it is known from their cage speeds "
            f"({_slip(evidence):+.4f} orders) and taken off.",
        ),
    )
    return Section(id="sum-rule", title="Speed or slip? The sum of the race lines", blocks=(table, *_reading(evidence)))


def _slip(evidence: Evidence) -> float:
    return next(s.slip_difference for s in evidence.sums if s.origin == "simulated")


def _reading(evidence: Evidence) -> list[Paragraph]:
    rig = next(s for s in evidence.sums if s.source == "paper's rig")
    inner = evidence.printed.of("inner")
    implied = 60 * inner.rig_hz / (inner.kinematic_hz / (evidence.printed.shaft_rpm / 60))
    texts = [
        "In one and the same record a slipping cage lowers BPFO and **raises** BPFI by as many hertz, so the sum does "
        "not move. The paper's rig "
        f"pair adds up to {rig.difference_pct:+.2f} %, as a shaft at {rig.implied_rpm:.1f} rpm would give; its "
        "inner-race "
        f"line alone means {implied:.1f} rpm. An inner-race line 1 % low is therefore no sign of slip, as the paper "
        "reads it: the plainest reading is a shaft that ran slower in that recording.",
    ]
    measured = [s for s in evidence.sums if s.origin == "measured"]
    if measured:
        s = measured[0]
        ratio = 100 * s.bpfo_order / s.rolling_elements
        texts.append(
            f"With the speed measured, the rig's own recordings add up to {s.total:.3f} ± {s.ci95 or 0:.3f} orders: "
            "no slip "
            f"of 1 %, nothing like it. The cage turns at {ratio:.3f} % of the shaft."
        )
    return [Paragraph(text) for text in texts]
