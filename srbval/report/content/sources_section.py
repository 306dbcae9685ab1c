"""What was compared with what: every record with its origin, speed and verdict."""

from __future__ import annotations

from pathlib import Path

from srbval.evidence.gather import Evidence
from srbval.recordings import Origin
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Callout, Listing, Paragraph
from srbval.report.content.names import FETCH_COMMAND, badge_of, rpm_of
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.validation.analyse import Analysis


def sources_section(evidence: Evidence) -> Section:
    """One row a record; a warning where the rig side is synthetic."""
    sides = [("paper's speed", evidence.paper)]
    if evidence.measured_states:
        sides.append(("beside the rig", {s: evidence.beside_rig[s] for s in evidence.measured_states}))
    sides.append(("rig side", evidence.rig))
    rows = [_row(group, a) for group, analyses in sides for a in analyses.values()]
    table = Table(
        id="records",
        label="Records",
        caption="All records in this report; each went through the same chain: rotation (two axes only), "
        "normalisation, then in one pass band-pass without phase shift, Hilbert transform and envelope, ends dropped; "
        "lines are read jointly from the squared envelope [squared standard deviations of the record]. **Tracked**: "
        "resampled to even shaft angles, because with the speed the race lines move by more than one bin.",
        columns=(
            Column(title="Record"),
            Column(title="For"),
            Column(title="State"),
            Column(title="Shaft", unit="rpm", format=".2f"),
            Column(title="Length", unit="s", format=".3g"),
            Column(title="Band", unit="Hz"),
            Column(title="Lines found (from kinematic)"),
        ),
        rows=rows,
    )
    return Section(
        id="records-section",
        title="What was compared with what",
        blocks=(*_warning(evidence), _kinds(evidence), table, _sensor()),
    )


def _kinds(evidence: Evidence) -> Listing:
    """What the marks mean, and how many records of each kind there are."""
    origins = [a.recording.origin for a in (*evidence.rig.values(),)]
    measured, synthetic = (sum(o is kind for o in origins) for kind in (Origin.MEASURED, Origin.STAND_IN))
    return Listing(
        items=(
            f"**simulated**: runs of the bundled model, {len(evidence.runs)} in this report.",
            f"**measured**: recordings of the paper's own test rig, {measured} of {len(origins)} states.",
            "**published**: values printed in the paper, without a recording behind them here.",
            f"**stand-in**: a synthetic signal where no recording is registered, {synthetic} of {len(origins)} states; "
            "it fills a panel and enters no verdict.",
        )
    )


def _row(group: str, analysis: Analysis) -> list[Cell | Value]:
    recording = analysis.recording
    name = Path(recording.file).name if recording.file else "model run"
    low, high = analysis.processed.band_hz
    state = recording.state.label if recording.state else "not stated"
    ci95 = 60 * analysis.speed.ci95_hz or None
    return [
        Cell(value=name, badge=badge_of(analysis)),
        group,
        state,
        Cell(value=rpm_of(analysis), ci95=ci95, note=analysis.speed.source.value),
        recording.seconds,
        f"{low:g} to {high:g}, {analysis.processed.band_filter.value}{', tracked' * analysis.processed.tracking.used}",
        finding(analysis),
    ]


def finding(analysis: Analysis) -> str:
    """The detected race and roller lines in a few words."""
    lines = [n for n in analysis.lines if n.detected and n.harmonic == 1 and n.name in ("BPFO", "BPFI", "2xBSF")]
    if not lines:
        return "no race or roller line"
    strongest_first = sorted(lines, key=lambda n: -(n.snr or 0))
    return "; ".join(f"{n.name} {n.found_hz:.2f} Hz ({n.deviation_pct:+.2f} %)" for n in strongest_first)


def _warning(evidence: Evidence) -> list[Block]:
    synthetic = [s.label for s, a in evidence.rig.items() if a.recording.origin is Origin.STAND_IN]
    if not synthetic:
        return []
    return [
        Callout(
            tone=Tone.WARNING,
            title="The rig side is partly or wholly synthetic",
            text=f"No measured recording is registered for: {', '.join(synthetic)}. Its panels show a "
            "synthetic stand-in, a "
            f"seeded impulse model, and enter no verdict. `{FETCH_COMMAND}` brings the real ones.",
        )
    ]


def _sensor() -> Paragraph:
    return Paragraph(
        "The rig has one accelerometer at 45 degrees per bearing, so its records are used as they are; the model's "
        "two radial "
        "axes are rotated by 45 degrees onto that direction first."
    )
