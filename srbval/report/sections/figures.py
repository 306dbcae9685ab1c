"""Figures 11 to 14 of the paper and the same figures of any pair of signals, model beside rig on identical axes.

Figures of a pair are drawn as soon as both recordings are read, and only the files of the figures are kept. For each
kind of figure, computed quantities decide whether model and rig are alike.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.comparison.comparison import Verdict
from srbval.recordings import Origin
from srbval.report.blocks import Figure, FigureGrid, ReportRow, Section
from srbval.report.figures import style
from srbval.report.figures.signals import draw_acceleration, draw_scalogram, draw_spectrum
from srbval.report.figures.style import Panel, PanelData, new_axes
from srbval.report.findings import records
from srbval.report.findings.findings import Findings, picture_rows
from srbval.report.findings.records import RecordView, SpectrumView
from srbval.report.prose import Prose
from srbval.signal.spectrum import SCALOGRAM_HZ
from srbval.storage.json_files import json_text
from srbval.validation.validate import SIDES, PairReading

FIGURE_TEXTS, PAIR_TEXTS = (Prose("srbval.report", f"texts/{name}.md") for name in ("figures", "pairs"))

SPECTRUM_HZ = 600.0  # end of the spectra in Figures 12 and 13
LETTERS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
PAPER_FIGURES = {  # kind and bearing states of each figure
    "11": ("acceleration", tuple(LETTERS)),
    "12": ("spectrum", (Fault.OUTER,)),
    "13": ("spectrum", (Fault.INNER,)),
    "14": ("scalogram", tuple(LETTERS)),
}
COLOUR_QUANTILE = 0.995  # end of the colour scale, so that one burst does not darken the rest
HEAD_ROOM, PANEL_LABEL_ROOM = 1.12, 1.4  # end of a shared axis over the highest value: signals, spectra with labels
MAX_ERROR_BARS = 40  # rows of the figure of errors
VERDICT_COLOURS = (style.GREEN, style.VERMILION, style.SOFT, style.ORANGE, style.GREEN, style.VERMILION)
VERDICT_LOOK = dict(zip(Verdict, zip(VERDICT_COLOURS, "osv^DX", strict=True), strict=True))  # colour and marker


def figures_section(findings: Findings) -> Section:
    """Make the sixteen panels of Figures 11 to 14, and a sentence for each figure on how model and rig compare."""
    pictures, views = findings.data["pictures"], findings.views
    scale = shared_limits([one for side in views.values() for one in side.values()])
    panels: dict[str, list[Figure]] = {number: [] for number in PAPER_FIGURES}
    for state, letters in LETTERS.items():
        spectra = [_spectrum(side, state) for side in views.values()]
        top = PANEL_LABEL_ROOM * max(records.peak_amplitude(view.record, SPECTRUM_HZ) for view in spectra)
        for view, *letter in zip(spectra, letters, "ab", strict=True):
            made = panels_of(view, state, scale | {"spectrum": top}, *letter)
            for number, (kind, states) in PAPER_FIGURES.items():
                label = f"{number}{letter[kind == 'spectrum']}"
                if state in states:
                    explore = explore_spectrum(view) if kind == "spectrum" else ""
                    own = replace(made[kind], id=f"fig{label}", label=f"Figure {label}", explore=explore)
                    panels[number].append(own)
    sentences = {"12": level_sentence(pictures, "5xBPFO", "fifth")}
    sentences["13"] = level_sentence(pictures, "BPFI sidebands", "sidebands")
    grids = []
    for number, (kind, states) in PAPER_FIGURES.items():
        judged = [state for state in states if state.line or kind != "scalogram"]
        alike = "; ".join(f"**{state.label}**: {picture_verdict(pictures, kind, state)}" for state in judged)
        words: dict[str, Any] = {"alike": alike, "sentence": sentences.get(number, "")}
        grids.append(FIGURE_TEXTS.grid(f"grid-{number}", panels[number], f"Figure {number}", **words))
    bands = {side: of[Fault.OUTER].analysis.processed.band_hz for side, of in views.items()}
    shown_bands = {f"{side}_band": f"{low:g} to {high:g}" for side, (low, high) in bands.items()}
    return FIGURE_TEXTS.section(FIGURE_TEXTS.paragraph("intro", **shown_bands), *grids)


def _spectrum(views: Mapping[Fault, RecordView], state: Fault) -> SpectrumView:
    """Prepare the envelope spectra of the record in `state` (harmonics of its fault marked) and the healthy record."""
    record, line = views[state], state.line
    cursors = records.fault_cursors(record, record.analysis.line(line), SPECTRUM_HZ, 2) if line else ()
    found = tuple((hz, height) for name, hz, height in record.peaks if line and name.startswith(line))
    return SpectrumView(record=record, healthy=views[Fault.HEALTHY], cursors=cursors, peaks=found, end_hz=SPECTRUM_HZ)


def shared_limits(views: Sequence[RecordView]) -> dict[str, float]:
    """Return common ends, for several records, of the amplitude axis of signals and of the scalograms' colour scale."""
    pixels = np.concatenate([one.scalogram.amplitude.ravel() for one in views])
    highest, brightest = max(one.highest for one in views), np.quantile(pixels, COLOUR_QUANTILE)
    return {"acceleration": HEAD_ROOM * highest, "scalogram": float(brightest)}


def panels_of(
    view: SpectrumView, state: Fault, scale: Mapping[str, float], letter: str = "", spectrum_letter: str = ""
) -> dict[str, Figure]:
    """Make a record's panels by kind; `scale` contains the ends of their amplitude axes or colour scales by kind."""
    record, (low_hz, high_hz) = view.record, SCALOGRAM_HZ
    title = f"{state.label}, {60 * record.shaft_hz:.4g} rpm"
    line = record.analysis.line_of(state) if state.line else None
    period = (f"1/{line.name}", 1 / line.kinematic_hz) if line else None
    head: dict[str, Any] = {"letter": letter, "title": title}
    plots = {
        "acceleration": Panel(draw_acceleration, record, limit=scale["acceleration"], period=period, **head),
        "spectrum": Panel(draw_spectrum, view, top=scale["spectrum"], letter=spectrum_letter, title=title, brief=True),
        "scalogram": Panel(draw_scalogram, record, state, top=scale["scalogram"], **head),
    }
    side = "rig" if record.origin is Origin.MEASURED else "model"
    words: dict[str, Any] = {"badge": record.origin, "who": f"{side}, {state.label}, {60 * record.shaft_hz:.2f} rpm"}
    words |= {"low_hz": low_hz, "high_hz": high_hz, "end_hz": view.end_hz, "line": state.line or "no line"}
    return {kind: FIGURE_TEXTS.figure(kind, plot, **words) for kind, plot in plots.items()}


def picture_verdict(pictures: Iterable[ReportRow], kind: str, state: Fault) -> str:
    """State if model and rig are alike, by the quantity whose difference is largest relative to its limit."""
    rows = [one for one in pictures if (one["kind"], one["state"]) == (kind, state)]
    found = max(rows, key=lambda one: abs(one["model"] - one["rig"]) / one["limit"], default=None)
    if found is None:
        return FIGURE_TEXTS.text("not-compared")
    unit = f" {found['unit']}" if found["unit"] else ""
    return FIGURE_TEXTS.text("alike" if found["alike"] else "differs", **{**found, "unit": unit})


def level_sentence(pictures: Iterable[ReportRow], what: str, name: str) -> str:
    """State whether the line `what` is weaker in the model than in the rig; `name` selects the text for this line."""
    row = next((one for one in pictures if one["what"] == what), None)
    if row is None:
        return FIGURE_TEXTS.text(f"{name}-unread")
    return FIGURE_TEXTS.text(f"{name}-weak" if row["model"] < row["rig"] - row["limit"] else f"{name}-there", **row)


def explore_spectrum(view: SpectrumView) -> str:
    """Return the description (JSON) from which the page's script draws the interactive chart of an envelope spectrum.

    `x` and the keys of `curves` are columns of the figure's CSV file. `marks` are names and x positions of the
    frequencies to mark, `x_per_order` is the width of one shaft order in units of the x axis.
    """
    axes = {"x": "frequency_hz", "x_label": "Frequency, Hz", "y_label": f"Envelope, {view.record.unit}"}
    curves = {"amplitude": "this record"} | ({"healthy_amplitude": "healthy record"} if view.healthy else {})
    marks = [(cursor.name, cursor.frequency_hz) for cursor in view.cursors]
    return json_text(axes | {"curves": curves, "marks": marks, "x_per_order": view.record.shaft_hz})


def pair_figures(one: PairReading) -> tuple[FigureGrid, ...]:
    """Draw waveform, spectrum and scalogram of model and rig at once; if one is missing, only of the other.

    The figures contain the files drawn, so that the arrays of the pair are not kept.
    """
    state, analyses = one.state, [one.sides[side].analyses[0] for side in SIDES if side in one.sides]
    views = [records.record_view(analysis, window_s=records.middle_window(analysis)) for analysis in analyses]
    lines = [analysis.line_of(state) if state.line else None for analysis in analyses]
    # up to the same shaft order
    order = min(records.spectrum_end_hz(v.analysis, line) / v.shaft_hz for v, line in zip(views, lines, strict=True))
    spectra = [records.spectrum_view(v, None, line, order * v.shaft_hz) for v, line in zip(views, lines, strict=True)]
    kinds = dict[str, list[Figure]](acceleration=[], spectrum=[], scalogram=[])
    scale = shared_limits(views) | {"spectrum": PANEL_LABEL_ROOM * max(one.highest for one in spectra)}
    for view, spectrum in zip(views, spectra, strict=True):
        for kind, panel in panels_of(spectrum, state, scale).items():
            assert isinstance(panel.draw, Panel)
            name, draw = f"pair-{one.number}-{kind}-{view.origin.value}", partial(style.write_files, panel.draw.files())
            kinds[kind].append(replace(panel, id=name, label=f"Pair {one.number}", draw=draw))
    if len(views) < 2:
        alike = dict.fromkeys(kinds, PAIR_TEXTS.text("one-side"))
    else:
        rows = list(picture_rows(state, views, one.rows))
        alike = {kind: picture_verdict(rows, kind, state) for kind in kinds}
    return tuple(PAIR_TEXTS.grid(f"grid-{kind}", figures, alike=alike[kind]) for kind, figures in kinds.items())


def draw_errors(rows: Sequence[Mapping[str, Any]], axes: Any = None) -> PanelData:
    """Draw error [%] and uncertainty of the first `MAX_ERROR_BARS` rows, coloured by their verdict, e.g. agrees."""
    shown = rows[:MAX_ERROR_BARS]
    axes = axes or new_axes((6.4, 1.1 + 0.24 * len(shown)))
    axes.axvline(0.0, color=style.INK, lw=0.8)
    for place, row in enumerate(shown):
        colour, mark = VERDICT_LOOK[row["verdict"]]
        look: dict[str, Any] = {"color": colour, "marker": mark, "mfc": "white", "mew": 1.2, "ls": "none"}
        axes.errorbar(row["error"], place, xerr=row["uncertainty"], label=row["verdict"], ms=5.5, capsize=3, **look)
    names = [f"pair {row['pair']}: {row['quantity']}" for row in shown]
    axes.set_yticks(range(len(shown)), labels=names, parse_math=False)
    axes.set(ylim=(len(shown) - 0.4, -0.6), xlabel="Error, simulated less measured, %")
    axes.grid(False, axis="y")
    style.legend_above(axes)
    keys = ("pair", "quantity", "error", "uncertainty", "verdict")
    return axes.figure, {key: [row[key] for row in shown] for key in keys}
