"""Figures of one comparison: waveform, envelope spectrum and scalogram, simulated left, measured right, same axes.

Figures are drawn as soon as both recordings are read, and only the files of the figures are kept. For each kind of
figure, computed quantities decide whether model and rig are alike.
"""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.report.blocks import Figure, FigureGrid
from srbval.report.figures import style
from srbval.report.figures.style import Drawing, PanelData, new_axes, panel
from srbval.report.findings.records import (
    RecordView,
    SpectrumView,
    envelope_scalogram,
    middle_window,
    peak_amplitude,
    record_view,
    spectrum_end_hz,
    spectrum_view,
)
from srbval.report.findings.rows import picture_rows
from srbval.report.prose import Prose
from srbval.report.sections.figures import (
    FIGURE_TEXTS,
    PANEL_LABEL_ROOM,
    axis_ends,
    drawings,
    panel_words,
    picture_verdict,
    shared_limits,
)
from srbval.validation.validate import SIDES, PairReading

PAIR_TEXTS = Prose("srbval.report", "texts/pairs.md")
MAX_ERROR_BARS = 40  # rows of the figure of errors
VERDICT_LOOK = {
    "differs": (style.VERMILION, "s"),
    "missed": (style.VERMILION, "X"),
    "agrees": (style.GREEN, "o"),
    "met": (style.GREEN, "D"),
    "not resolved": (style.SOFT, "v"),
    "insufficient data": (style.ORANGE, "^"),
}


def draw_now(draw: Drawing, folder: Path, name: str) -> Drawing:
    """Draw a panel to files in `folder` now; return a function that copies these files instead of drawing again."""
    draw(folder, name)

    def copy(to: Path, as_name: str) -> None:
        to.mkdir(parents=True, exist_ok=True)
        for suffix in (".svg", ".csv"):
            shutil.copyfile(folder / f"{name}{suffix}", to / f"{as_name}{suffix}")

    return copy


def pair_figures(one: PairReading, folder: Path) -> tuple[FigureGrid, ...]:
    """Draw waveform, spectrum and scalogram of model and rig into `folder`; if one is missing, only of the other."""
    state, analyses = one.state, [one.sides[side].analyses[0] for side in SIDES if side in one.sides]
    views = [record_view(analysis, window_s=middle_window(analysis)) for analysis in analyses]
    images, spectra = [envelope_scalogram(view) for view in views], _spectra(views, state)
    top = PANEL_LABEL_ROOM * max(peak_amplitude(one.record, one.end_hz) for one in spectra)
    kinds = dict[str, list[Figure]](acceleration=[], spectrum=[], scalogram=[])
    scale = shared_limits(views, images) | {"top": top}
    for view, image, spectrum in zip(views, images, spectra, strict=True):
        for kind, plot in drawings(spectrum, image, state, scale).items():
            name = f"pair-{one.number}-{kind}-{view.origin.value}"
            words = panel_words(name, f"Pair {one.number}", view, state) | {"line": state.line or "no line"}
            more: dict[str, Any] = axis_ends(spectrum.end_hz)
            kinds[kind].append(FIGURE_TEXTS.figure(kind, draw_now(plot, folder, name), **words, **more))
    if len(views) < 2:
        alike = dict.fromkeys(kinds, PAIR_TEXTS.text("one-side"))
    else:
        rows = list(picture_rows(state, views, images, one.rows))
        alike = {kind: picture_verdict(rows, kind, state) for kind in kinds}
    return tuple(PAIR_TEXTS.grid(f"grid-{kind}", figures, alike=alike[kind]) for kind, figures in kinds.items())


def _spectra(views: Sequence[RecordView], state: Fault) -> list[SpectrumView]:
    """Prepare the envelope spectra of model and rig up to the same shaft order."""
    lines = [view.analysis.line_of(state) if state.line else None for view in views]
    order = min(spectrum_end_hz(v.analysis, line) / v.shaft_hz for v, line in zip(views, lines, strict=True))
    return [spectrum_view(v, None, line, order * v.shaft_hz) for v, line in zip(views, lines, strict=True)]


def errors_figure(rows: Sequence[Mapping[str, Any]]) -> PanelData:
    """Draw error [%] and uncertainty of at most `MAX_ERROR_BARS` compared quantities; colours show the verdicts."""
    figure, axes = new_axes((6.4, 1.1 + 0.24 * len(rows[:MAX_ERROR_BARS])))
    shown = draw_error_bars(axes, rows)
    return figure, {key: [row[key] for row in shown] for key in ("pair", "quantity", "error", "uncertainty", "verdict")}


def draw_error_bars(axes: Any, rows: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """Draw error bars [%] onto given axes as `errors_figure` does; return the rows that were drawn."""
    shown = rows[:MAX_ERROR_BARS]
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
    return shown


errors_panel = panel(errors_figure)
