"""Figures of a pair: waveform, envelope spectrum and scalogram, simulated left and measured right on the same axes.

They are drawn as soon as a pair is read, and only the files are kept. Each kind of figure has one number by which both
sides are called alike or not.
"""

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.comparison.comparison import VERDICT, Row
from srbval.report.blocks import Figure, FigureGrid
from srbval.report.figures import style
from srbval.report.figures.images import scalogram_panel
from srbval.report.figures.plot import HEAD_ROOM
from srbval.report.figures.signals import acceleration_panel, spectrum_panel
from srbval.report.figures.style import Drawing, Drawn, new_axes, panel
from srbval.report.findings.records import (
    WINDOW_TURNS,
    RecordView,
    SpectrumView,
    envelope_scalogram,
    highest_of,
    record_view,
    spectrum_end_hz,
    spectrum_view,
)
from srbval.report.prose import Prose
from srbval.report.sections.figures import COLOUR_QUANTILE, LABEL_ROOM, panel_words
from srbval.report.sections.figures import TEXTS as FIGURES
from srbval.signal import Scalogram
from srbval.signal.spectrum import SCALOGRAM_HZ
from srbval.validation.sides import SideReading
from srbval.validation.validate import SIDES, PairReading

TEXTS = Prose("srbval.report", "texts/pairs.md")
LINE_SHARE = 2 ** (1 / 6)  # edges of the third octave about a line, as factors
BARS = 40  # rows in the picture of errors
VERDICT_LOOK = {
    "differs": (style.VERMILION, "s"),
    "missed": (style.VERMILION, "X"),
    "agrees": (style.GREEN, "o"),
    "met": (style.GREEN, "D"),
    "not resolved": (style.SOFT, "v"),
    "insufficient data": (style.ORANGE, "^"),
}


def drawn_now(draw: Drawing, folder: Path, name: str) -> Drawing:
    """Draw a panel into `folder` now, and return a drawing that copies its files."""
    draw(folder, name)

    def copy(to: Path, as_name: str) -> None:
        to.mkdir(parents=True, exist_ok=True)
        for suffix in (".svg", ".csv"):
            shutil.copyfile(folder / f"{name}{suffix}", to / f"{as_name}{suffix}")

    return copy


def pair_figures(one: PairReading, folder: Path) -> tuple[FigureGrid, ...]:
    """The three rows of panels of a pair, drawn into `folder`; panels of the sides that there are."""
    state, views = one.state, [_view(one.sides[side]) for side in SIDES if side in one.sides]
    images = [envelope_scalogram(view) for view in views]
    titles = [f"{state.label}, {60 * view.shaft_hz:.4g} rpm" for view in views]
    limit = HEAD_ROOM * max(float(max(np.abs(view.acceleration).max(), view.envelope.max())) for view in views)
    spectra = _spectra(views, state)
    top = LABEL_ROOM * max(highest_of(one.record, one.end_hz) for one in spectra)
    brightest = float(np.quantile(np.concatenate([one.amplitude.ravel() for one in images]), COLOUR_QUANTILE))
    kinds = dict[str, list[Figure]](acceleration=[], spectrum=[], scalogram=[])
    for view, image, spectrum, title in zip(views, images, spectra, titles, strict=True):
        line = view.analysis.line_of(state) if state.line else None
        period = (f"1/{line.name}", 1 / line.kinematic_hz) if line else None
        plots = {
            "acceleration": acceleration_panel(view, limit=limit, title=title, period=period),
            "spectrum": spectrum_panel(spectrum, top=top, title=title, brief=True),
            "scalogram": scalogram_panel(view, image, state, top=brightest, title=title),
        }
        reach: dict[str, Any] = dict(
            zip(("low_hz", "high_hz", "end_hz"), (*SCALOGRAM_HZ, spectrum.end_hz), strict=True)
        )
        for kind, plot in plots.items():
            name = f"pair-{one.number}-{kind}-{view.origin.value}"
            words = panel_words(name, f"Pair {one.number}", view, state) | {"line": state.line or "no line"}
            kinds[kind].append(FIGURES.figure(kind, drawn_now(plot, folder, name), **words, **reach))
    sentences = dict(zip(kinds, _sentences(views, images, state, one.rows), strict=True))
    return tuple(TEXTS.grid(f"grid-{kind}", figures, alike=sentences[kind]) for kind, figures in kinds.items())


def _view(side: SideReading) -> RecordView:
    """Arrays of the first signal of a side, in the middle `WINDOW_TURNS` revolutions."""
    analysis = side.analyses[0]
    whole = analysis.processed.samples.size / analysis.processed.fs_hz
    length = min(whole, WINDOW_TURNS / analysis.speed.value_hz)
    return record_view(analysis, window_s=((whole - length) / 2, (whole + length) / 2))


def _spectra(views: Sequence[RecordView], state: Fault) -> list[SpectrumView]:
    """Spectra of all views up to the same order of the shaft."""
    lines = [view.analysis.line_of(state) if state.line else None for view in views]
    order = min(spectrum_end_hz(v.analysis, line) / v.shaft_hz for v, line in zip(views, lines, strict=True))
    return [spectrum_view(v, None, line, order * v.shaft_hz) for v, line in zip(views, lines, strict=True)]


def _sentences(
    views: Sequence[RecordView], images: Sequence[Scalogram], state: Fault, rows: Sequence[Row]
) -> Iterator[str]:
    """One sentence a row of panels: whether both sides are alike, and by which number."""
    if len(views) < 2:
        yield from [TEXTS.text("one-side")] * 3
        return
    yield alike_sentence(
        "kurtosis of the band-passed signal", *(kurtosis(view.analysis.processed.filtered) for view in views)
    )
    line = next((row for row in rows if row["quantity"] == state.line and not math.isnan(row["error"])), None)
    yield spectrum_sentence(line, [row for row in rows if row["error_unit"] == "dB"])
    if state.line is None:
        yield TEXTS.text("no-line")
        return
    shares = (
        line_share(image, view.analysis.line_of(state).kinematic_hz) for image, view in zip(images, views, strict=True)
    )
    yield alike_sentence(f"share of the wavelet power in the third octave about {state.line}", *shares)


def kurtosis(signal: Any) -> float:
    """Fourth moment about the mean over the square of the second, 3 for Gaussian noise."""
    centred = np.asarray(signal) - np.mean(signal)
    return float(np.mean(centred**4) / np.mean(centred**2) ** 2)


def line_share(image: Scalogram, line_hz: float) -> float:
    """Share of a scalogram's power in the third octave about a line, 0 outside its range of frequencies."""
    power = (np.asarray(image.amplitude) ** 2).mean(axis=1)
    frequency = np.asarray(image.frequency_hz)
    near = (frequency >= line_hz / LINE_SHARE) & (frequency <= line_hz * LINE_SHARE)
    return float(power[near].sum() / power.sum())


def alike_sentence(what: str, simulated: float, measured: float) -> str:
    """Sentence on one number of both sides: alike if they differ by at most `share_pct` of the budget."""
    word = "alike" if abs(simulated - measured) <= VERDICT.share_pct / 100 * abs(measured) else "not alike"
    return TEXTS.text("alike", word=word, what=what, simulated=simulated, measured=measured, pct=VERDICT.share_pct)


def spectrum_sentence(line: Row | None, levels: Sequence[Row]) -> str:
    """Sentence on the places and the levels of the lines."""
    if line is None:
        return TEXTS.text("line-missing")
    known = [abs(row["error"]) for row in levels if not math.isnan(row["error"])]
    within = sum(error <= VERDICT.level_db for error in known)
    return TEXTS.text("spectrum-alike", **line, within=within, known=len(known), level_db=VERDICT.level_db)


def errors_figure(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Error of each line and cage ratio with its uncertainty, a mark for each verdict; at most `BARS` rows."""
    shown = rows[:BARS]
    figure, axes = new_axes((6.4, 1.1 + 0.24 * len(shown)))
    axes.axvline(0.0, color=style.INK, lw=0.8)
    for place, row in enumerate(shown):
        colour, mark = VERDICT_LOOK[row["verdict"]]
        look: dict[str, Any] = {"color": colour, "marker": mark, "mfc": "white", "mew": 1.2, "ls": "none"}
        axes.errorbar(row["error"], place, xerr=row["uncertainty"], label=row["verdict"], ms=5.5, capsize=3, **look)
    names = [f"pair {row['pair']}: {row['quantity']}" for row in shown]
    axes.set_yticks(range(len(shown)), labels=names, parse_math=False)
    axes.set(ylim=(len(shown) - 0.4, -0.6), xlabel="Error, simulated less measured, %")
    axes.grid(False, axis="y")
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    corner: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 4, "frameon": False}
    axes.legend(handles.values(), handles, **corner)
    return figure, {key: [row[key] for row in shown] for key in ("pair", "quantity", "error", "uncertainty", "verdict")}


errors_panel = panel(errors_figure)
