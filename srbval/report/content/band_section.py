"""The demodulation bands: how impulsive the others are, and each side's line in the other side's band."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from srbval.evidence.gather import Evidence
from srbval.recordings import Origin
from srbval.report.badges import Badge
from srbval.report.blocks import Figure, FigureGrid, Paragraph
from srbval.report.content.names import SIDE_NAME, badge_of
from srbval.report.figures.kurtogram import kurtogram_panel
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.signal import Kurtogram
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.band_choice import band_kurtogram
from srbval.validation.cross_band import RACE_DEFECTS, CrossBand

ORIGIN_NAME = {"simulated": "model", "measured": "rig", "stand-in": "stand-in"}
TOP_HZ = 10_240.0  # both sides to the rig's Nyquist frequency


def band_section(evidence: Evidence, crossed: tuple[CrossBand, ...], folder: Path) -> Section:
    """Kurtograms beside the bands used, and the table of crossed bands."""
    shown = [side[s] for s in RACE_DEFECTS for side in (evidence.beside_rig, evidence.rig)]
    pictures = [(a, band_kurtogram(a.recording, a.bearing, a.speed)) for a in shown]
    return Section(
        id="bands",
        title="Band choice: what the bands are, and what others would show",
        blocks=(
            Paragraph(
                "Lines are read from the **squared envelope**, Figures 11 to 13 show the envelope (modulus) as the "
                "paper does; "
                f"both of {evidence.paper[next(iter(RACE_DEFECTS))].processed.chain} for the model, of "
                f"{evidence.rig[next(iter(RACE_DEFECTS))].processed.chain} for the rig, in standard deviations of the "
                "record. The bands are the paper's, fixed before any of these records was looked at, so they cost no "
                "trial. A band chosen on the record that is then judged (`srbval analyse --auto-band`) counts every "
                "band tried in its false-alarm probabilities."
            ),
            _kurtograms(pictures, folder),
            *impulsive_remarks(pictures),
            _table(evidence, crossed),
            _reading(crossed),
        ),
    )


def impulsive_remarks(pictures: Sequence[tuple[Analysis, Kurtogram]]) -> tuple[Paragraph, ...]:
    """Where a measured record's most impulsive band shows its line at another frequency than the band used."""
    told = [_two_combs(analysis, picture) for analysis, picture in pictures if badge_of(analysis) is Badge.MEASURED]
    return tuple(Paragraph(text) for text in told if text)


def _two_combs(analysis: Analysis, picture: Kurtogram) -> str:
    state = analysis.recording.state
    if state not in RACE_DEFECTS:
        return ""
    other = analyse(
        analysis.recording, bearing=analysis.bearing, speed=analysis.speed, band_hz=within_nyquist(picture, analysis)
    )
    ours, theirs = analysis.line_of(state), other.line_of(state)
    if not (ours.detected and theirs.detected) or ours.found_hz is None or theirs.found_hz is None:
        return ""
    if abs(ours.found_hz - theirs.found_hz) <= math.hypot(ours.ci95_hz or 0.0, theirs.ci95_hz or 0.0):
        return ""
    return (
        f"**Two combs in one record.** {state.label.capitalize()}: {ours.name} reads {_comb(analysis, ours.name)} in "
        f"the band used, but {_comb(other, theirs.name)} in the most impulsive one. The difference is neither noise "
        "nor speed, which is the same in both: the harmonics of either band agree with its own first. Two sets of "
        "rollers whose cages turn differently would make it: the two rows of a double-row bearing with a cage each, "
        "or another bearing on the shaft. Which it is, and which comb is the tested row's, the record does not tell: "
        "an order read in one band is that band's."
    )


def within_nyquist(picture: Kurtogram, analysis: Analysis) -> tuple[float, float]:
    """The most impulsive band, clear of zero and of half the sampling rate, where no filter reaches."""
    low, high = picture.best_hz
    margin = 0.01 * analysis.recording.fs_hz
    return max(low, margin), min(high, analysis.recording.fs_hz / 2 - margin)


def _comb(analysis: Analysis, name: str) -> str:
    """The line in orders with its interval, its band, and its further harmonics that show, as orders of the first."""
    shaft_hz, first = analysis.speed.value_hz, analysis.line(name)
    low, high = analysis.processed.band_hz
    rest = [
        f"{x.found_hz / x.harmonic / shaft_hz:.4f}"
        for x in analysis.lines
        if x.name == name and x.harmonic > 1 and x.detected and x.found_hz is not None
    ]
    agreeing = f"; harmonics 2 up, over their number: {', '.join(rest)}" if rest else ""
    found, half = (first.found_hz or 0.0) / shaft_hz, (first.ci95_hz or 0.0) / shaft_hz
    return f"{found:.4f} ± {half:.4f} orders ({low:.0f} to {high:.0f} Hz{agreeing})"


def _kurtograms(pictures: Sequence[tuple[Analysis, Kurtogram]], folder: Path) -> FigureGrid:
    panels = [
        _panel(f"kurtogram-{letter}", letter, analysis, picture, folder)
        for letter, (analysis, picture) in zip("abcd", pictures, strict=False)
    ]
    return FigureGrid(
        figures=tuple(panels),
        columns=2,
        label="Kurtograms",
        caption="Kurtosis of the complex envelope in every band of Nyquist / 2, 3, 4, 6, ..., less the 2 of Gaussian "
        "noise; white: the band used, red dots: the most impulsive one; grey: bands that begin at zero. Each panel has "
        "its own colours.",
    )


def _panel(name: str, letter: str, analysis: Analysis, picture: Kurtogram, folder: Path) -> Figure:
    recording, band_hz = analysis.recording, analysis.processed.band_hz
    state = recording.state.label if recording.state else "state not stated"
    best = picture.best_hz
    files = kurtogram_panel(
        folder, name, picture=picture, band_hz=band_hz, origin=recording.origin.value, letter=letter, title=state,
        top_hz=min(TOP_HZ, recording.fs_hz / 2),
    )  # fmt: skip
    return Figure(
        id=name,
        label=f"Kurtogram {letter}",
        caption=f"{SIDE_NAME[recording.origin]}, {state}: used {band_hz[0]:g} to {band_hz[1]:g} Hz; most impulsive "
        f"{best[0]:.0f} to {best[1]:.0f} Hz, kurtosis less 2 of {picture.kurtosis.max():.3g}, of "
        f"{picture.size} bands.",
        alt=f"Kurtogram of the {state} record, {SIDE_NAME[recording.origin]}, with the band used outlined.",
        file=files.picture,
        data=files.data,
        badge=badge_of(analysis),
        synthetic=recording.origin is Origin.STAND_IN,
    )


def _table(evidence: Evidence, crossed: tuple[CrossBand, ...]) -> Table:
    badges = {
        a.recording.origin.value: badge_of(a) for side in (evidence.beside_rig, evidence.rig) for a in side.values()
    }
    rows: list[list[Cell | Value]] = [
        [
            Cell(value=row.state.label, badge=badges[row.origin]),
            f"{row.band_hz[0]:g} to {row.band_hz[1]:g}{'' if row.own else ' (the other side’s)'}",
            row.line.name,
            Cell(value=row.line.found_hz, ci95=row.line.ci95_hz),
            row.line.deviation_pct,
            row.line.snr,
            row.line.depth,
            "yes" if row.line.detected else row.why or "no",
        ]
        for row in crossed
    ]
    return Table(
        id="crossed-bands",
        label="Crossed bands",
        caption="Each side's fault line in its own band and in the other side's.",
        columns=(
            Column(title="State"),
            Column(title="Band", unit="Hz"),
            Column(title="Line"),
            Column(title="Found", unit="Hz", format=".3f"),
            Column(title="From kinematic", unit="%", format="+.3f"),
            Column(title="Line over noise", unit="times", format=".3g"),
            Column(title="Depth", unit="of the mean", format=".3g"),
            Column(title="Detected"),
        ),
        rows=rows,
    )


def _reading(crossed: tuple[CrossBand, ...]) -> Paragraph:
    """Which crossed readings still find the line, in a sentence a side."""
    texts = []
    for origin in dict.fromkeys(row.origin for row in crossed):
        other = [row for row in crossed if row.origin == origin and not row.own]
        found = " and ".join(row.line.name for row in other if row.line.detected)
        lost = " and ".join(row.line.name for row in other if not row.line.detected)
        said = "; ".join(part for part in (found and f"still shows {found}", lost and f"does not show {lost}") if part)
        if said:
            texts.append(f"In the other side’s band the {ORIGIN_NAME[origin]} side {said}.")
    return Paragraph(" ".join(texts) or "No band was crossed: both sides use the same one, or a side is missing.")
