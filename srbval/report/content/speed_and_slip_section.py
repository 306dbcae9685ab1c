"""Speed effect against slip effect, line by line, and what follows for the paper's reading of its -1 %."""

from __future__ import annotations

from collections.abc import Sequence

from srbval.bearing import Fault
from srbval.evidence.gather import Evidence
from srbval.report.badges import Badge, Tone
from srbval.report.blocks import Block, Callout, Paragraph
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.comparison import deviation_pct
from srbval.validation.speed_and_slip import SpeedAndSlip, one_speed_reading, published_speeds

LISTED = 4
NOTHING_LIKE_PCT = 0.5  # half of the 1 % in question


def speed_and_slip_section(evidence: Evidence) -> Section:
    """Both tables, the published speeds, and the plain statement."""
    blocks: list[Block] = [
        Paragraph(
            "A line's deviation from kinematics at a **stated** speed has two causes: the shaft did not turn at that "
            "speed, or the cage slipped. They are told apart by a measured speed alone: (1 + total) = "
            "(1 + speed effect) x (1 + slip effect). Slip makes the cage slower, which **lowers BPFO and raises "
            "BPFI**; speed moves both the same way."
        ),
        _effects(evidence.slips),
        *_sums_of_one_record(evidence),
        _speeds(),
        _statement(evidence),
    ]
    return Section(id="speed-and-slip", title="Speed effect against slip effect", blocks=tuple(blocks))


def _effects(rows: Sequence[SpeedAndSlip]) -> Table:
    return Table(
        id="speed-and-slip-table",
        label="Speed and slip",
        caption="What a race line's deviation is made of. Measured records count from the nominal motor speed, so "
        "their speed effect holds the motor's own lag under load; Table 6 counts from its stated shaft speed.",
        columns=(
            Column(title="Record, line"),
            Column(title="Counted from", unit="rpm", format=".0f"),
            Column(title="Shaft", unit="rpm", format=".2f"),
            Column(title="Total", unit="%", format="+.3f"),
            Column(title="Speed effect", unit="%", format="+.3f"),
            Column(title="Slip effect", unit="%", format="+.3f"),
            Column(title="so the cage", unit="%", format="+.3f"),
        ),
        rows=[_row(r) for r in rows],
        notes=(
            "95 % half widths. **So the cage**: what the slip effect means for the cage's speed; a slipping cage is "
            "negative. Table 6 states neither speed nor uncertainty: its speeds are laid between the published means "
            "below, uncertain by half of what the lag changes between them, its lines by half a bin of 0.1 Hz.",
        ),
    )


def _row(r: SpeedAndSlip) -> list[Cell | Value]:
    return [
        Cell(value=f"{r.record}, {r.line}" if r.line not in r.record else r.record, badge=Badge(r.origin)),
        r.reference_rpm,
        Cell(value=r.shaft_rpm, ci95=r.shaft_ci95_rpm, note=r.speed_source),
        Cell(value=r.total_pct, ci95=r.total_ci95_pct),
        Cell(value=r.speed_pct, ci95=r.speed_ci95_pct),
        Cell(value=r.slip_pct, ci95=r.slip_ci95_pct),
        Cell(value=r.cage_pct, ci95=r.cage_ci95_pct),
    ]


def _sums_of_one_record(evidence: Evidence) -> list[Paragraph]:
    """BPFO + BPFI where one measured record shows both: nothing but its speed enters."""
    both = [
        (evidence.rig[s].recording.name, c)
        for s in evidence.measured_states
        if (c := evidence.rig[s].closure).sum_hz is not None
    ]
    return [
        Paragraph(
            f"Record {literal(name)} shows both race lines by itself: BPFO + BPFI = "
            f"{c.sum_hz:.3f} ± {c.sum_ci95_hz:.3f} Hz, "
            f"{c.difference_pct:+.3f} ± {c.ci95_pct:.3f} % from {evidence.bearing.rolling_elements} times its measured "
            f"shaft speed: {'closed' if c.closed else 'not closed'}. Slip cannot move this sum, a wrong speed would."
        )
        for name, c in both
    ]


def _speeds() -> Table:
    speeds = published_speeds()
    means = {(m.state, m.nominal_rpm): m.mean_rpm for m in speeds.means}
    nominal = sorted({m.nominal_rpm for m in speeds.means})
    rows: list[list[Value]] = [
        [state.value, *(x for n in nominal for x in (means[state, n], _from_outer(means, state, n)))] for state in Fault
    ]
    columns = [Column(title="State")]
    for n in nominal:
        columns += [Column(title=f"At {n:g} rpm nominal", unit="rpm", format=".3f")]
        columns += [Column(title="from the OR record", unit="%", format="+.2f")]
    return Table(
        id="published-speeds",
        label="Published shaft speeds",
        caption=f"Mean tachometer speeds of the rig's records, first {speeds.seconds:g} s of each, as published.",
        columns=tuple(columns),
        rows=rows,
        notes=(f"Source: {speeds.source}.",),
    )


def _from_outer(means: dict[tuple[Fault, float], float], state: Fault, nominal_rpm: float) -> float:
    return deviation_pct(means[state, nominal_rpm], means[Fault.OUTER, nominal_rpm])


def _statement(evidence: Evidence) -> Callout:
    inner = next(r for r in evidence.slips if r.origin == "published" and r.line == "BPFI")
    rpm, cage = one_speed_reading(evidence.printed, evidence.bearing)
    printed = evidence.printed.of("inner").rig_printed_pct
    text = (
        f"The paper's rig shows BPFI at {printed:+g} % and calls it slippage. Slip **raises** BPFI, so it cannot be: "
        f"a cage that explained it would have to run {inner.cage_pct:+.2f} ± {inner.cage_ci95_pct:.2f} % "
        f"**faster** than kinematics even after the likely speed is taken off. Of the {inner.total_pct:+.2f} %, "
        f"{inner.speed_pct:+.2f} ± {inner.speed_ci95_pct:.2f} % is the shaft's speed by the published means of this "
        f"rig, whose inner-race records run slower than the others at the same setting. Taken as one speed the two "
        f"lines of Table 6 give {rpm:.1f} rpm and a cage {cage:+.2f} % off, again too fast to slip. The remaining "
        f"{inner.slip_pct:+.2f} ± {inner.slip_ci95_pct:.2f} % is what neither explains with the data at hand: most "
        "simply a still slower shaft in that recording."
    )
    return Callout(tone=Tone.NEUTRAL, title="What follows for the paper's “−1 %, slippage”", text=text + _own(evidence))


def _own(evidence: Evidence) -> str:
    """What the rig's own records say with their speed measured; many are told by their range."""
    measured = [r for r in evidence.slips if r.origin == "measured" and r.speed_source == "tachometer"]
    if not measured:
        return ""
    if len(measured) <= LISTED:
        said = ", ".join(f"{r.line} {r.slip_pct:+.3f} ± {r.slip_ci95_pct:.3f} %" for r in measured)
    else:
        slips = [r.slip_pct for r in measured]
        said = f"{min(slips):+.3f} to {max(slips):+.3f} % in {len(slips)} race-fault records"
    largest = max(abs(r.slip_pct) + r.slip_ci95_pct for r in measured)
    judged = "no slip of 1 %, nothing like it" if largest < NOTHING_LIKE_PCT else "see the table"
    return f" With the speed measured, the rig's own records deviate by {said}: {judged}."
