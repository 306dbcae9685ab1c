"""Figures 11 to 14 of the paper, drawn for model and rig on identical axes, and whether both are alike."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.recordings import Origin
from srbval.report.blocks import Explore, Figure, ReportRow, Section
from srbval.report.figures.images import scalogram_panel
from srbval.report.figures.signals import acceleration_panel, spectrum_panel
from srbval.report.figures.style import Drawing
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import Cursor, RecordView, SpectrumView, fault_cursors, make_badge, peak_amplitude
from srbval.report.prose import Prose
from srbval.signal import Scalogram
from srbval.signal.spectrum import SCALOGRAM_HZ

FIGURE_TEXTS = Prose("srbval.report", "texts/figures.md")

SPECTRUM_HZ = 600.0  # end of the spectra in Figures 12 and 13
LETTERS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
PAPER_FIGURES = {  # kind and states of each figure
    "11": ("acceleration", tuple(LETTERS)),
    "12": ("spectrum", (Fault.OUTER,)),
    "13": ("spectrum", (Fault.INNER,)),
    "14": ("scalogram", (Fault.OUTER, Fault.INNER)),
}
FIGURE_SIDES = ("model", "rig")
COLOUR_QUANTILE = 0.995  # end of the colour scale, so that one burst does not darken the rest
HEAD_ROOM, PANEL_LABEL_ROOM = 1.12, 1.4  # end of a shared axis over the highest value: signals, spectra with labels


def figures_section(findings: Findings) -> Section:
    """Make the sixteen panels of Figures 11 to 14, and a sentence for each figure on how model and rig compare."""
    pictures = findings.data["pictures"]
    views, images = findings.views, findings.scalograms
    every = (side[state] for side in views.values() for state in side)
    scale = shared_limits(every, (side[state] for side in images.values() for state in side))
    panels: dict[str, list[Figure]] = {number: [] for number in PAPER_FIGURES}
    for state, letters in LETTERS.items():
        spectra = {side: _spectrum(views[side], state) for side in FIGURE_SIDES}
        top = PANEL_LABEL_ROOM * max(peak_amplitude(one.record, SPECTRUM_HZ) for one in spectra.values())
        for place, side in enumerate(FIGURE_SIDES):
            record, letter = views[side][state], (letters[place], "ab"[place])
            plots = drawings(spectra[side], images[side][state], state, scale | {"top": top}, letter)
            for number, (kind, states) in PAPER_FIGURES.items():
                if state not in states and kind != "scalogram":
                    continue
                label = f"{number}{letter[kind == 'spectrum']}"
                words = panel_words(f"fig{label}", f"Figure {label}", record, state) | axis_ends(SPECTRUM_HZ)
                if kind == "spectrum":
                    curves = {"amplitude": state.label, "healthy_amplitude": "healthy"}
                    words["explore"] = explore_spectrum(spectra[side], "Envelope amplitude, std. dev.", curves)
                panels[number].append(FIGURE_TEXTS.figure(kind, plots[kind], **words, line=state.line))
    sentences = {"12": level_sentence(pictures, "5xBPFO", "fifth")}
    sentences["13"] = level_sentence(pictures, "BPFI sidebands", "sidebands")
    grids = []
    for number, figures in panels.items():
        words = {"alike": figure_sentence(pictures, number), "sentence": sentences.get(number, "")}
        grids.append(FIGURE_TEXTS.grid(f"grid-{number}", figures, f"Figure {number}", **words))
    bands = {side: views[side][Fault.OUTER].analysis.processed.band_hz for side in FIGURE_SIDES}
    shown_bands = {f"{side}_band": f"{low:g} to {high:g}" for side, (low, high) in bands.items()}
    return FIGURE_TEXTS.section(FIGURE_TEXTS.paragraph("intro", **shown_bands), *grids)


def _spectrum(side: Mapping[Fault, RecordView], state: Fault) -> SpectrumView:
    """Prepare for one side (model or rig) a state's envelope spectrum over the healthy one, fault harmonics marked."""
    record, line = side[state], state.line
    cursors: tuple[Cursor, ...] = ()
    if line:
        line_hz, sidebands = record.analysis.line(line).kinematic_hz, 2 if state.sidebands else 0
        cursors = fault_cursors(line, line_hz, SPECTRUM_HZ, sideband_hz=record.shaft_hz, sidebands=sidebands)
    found = tuple((hz, height) for name, hz, height in record.peaks if line and name.startswith(line))
    return SpectrumView(record=record, healthy=side[Fault.HEALTHY], cursors=cursors, peaks=found, end_hz=SPECTRUM_HZ)


def shared_limits(views: Iterable[RecordView], images: Iterable[Scalogram]) -> dict[str, float]:
    """Return common ends for several records: ``limit`` of the amplitude axis, ``brightest`` of the colour scale."""
    highest = max(float(max(np.abs(one.acceleration).max(), one.envelope.max())) for one in views)
    pixels = np.concatenate([one.amplitude.ravel() for one in images])
    return {"limit": HEAD_ROOM * highest, "brightest": float(np.quantile(pixels, COLOUR_QUANTILE))}


def drawings(
    view: SpectrumView, image: Scalogram, state: Fault, scale: Mapping[str, float], letters: tuple[str, str] = ("", "")
) -> dict[str, Drawing]:
    """Prepare a record's panels acceleration, spectrum, scalogram; `scale` are axis limits (see `shared_limits`)."""
    record, (letter, of_spectrum) = view.record, letters
    title = f"{state.label}, {60 * record.shaft_hz:.4g} rpm"
    line = record.analysis.line_of(state) if state.line else None
    period = (f"1/{line.name}", 1 / line.kinematic_hz) if line else None
    head: dict[str, Any] = {"letter": letter, "title": title}
    return {
        "acceleration": acceleration_panel(record, limit=scale["limit"], period=period, **head),
        "spectrum": spectrum_panel(view, top=scale["top"], letter=of_spectrum, title=title, brief=True),
        "scalogram": scalogram_panel(record, image, state, top=scale["brightest"], **head),
    }


def figure_sentence(pictures: Iterable[ReportRow], number: str) -> str:
    """State for each bearing state in a figure whether model and rig are alike."""
    kind, of = PAPER_FIGURES[number]
    return "; ".join(f"**{state.label}**: {picture_verdict(pictures, kind, state)}" for state in of)


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


def explore_spectrum(view: SpectrumView, y_label: str, curves: Mapping[str, str]) -> Explore:
    """Describe the interactive chart of an envelope spectrum; `curves` labels the columns of its data file."""
    return Explore(
        x="frequency_hz",
        x_label="Frequency, Hz",
        y_label=y_label,
        curves=curves,
        marks=tuple((cursor.name, cursor.frequency_hz) for cursor in view.cursors),
        x_per_order=view.record.shaft_hz,
    )


def axis_ends(end_hz: float) -> dict[str, float]:
    """Return for captions: both ends [Hz] of a scalogram's frequency axis, and `end_hz` of a spectrum's."""
    return dict(zip(("low_hz", "high_hz", "end_hz"), (*SCALOGRAM_HZ, end_hz), strict=True))


def panel_words(name: str, label: str, record: RecordView, state: Fault) -> dict[str, Any]:
    """Return id, label and badge of a panel, and the words of its caption and alternative text."""
    side = "rig" if record.origin is Origin.MEASURED else "model"
    who = f"{side}, {state.label}, {60 * record.shaft_hz:.2f} rpm"
    return {"id": name, "label": label, "badge": make_badge(record.analysis), "who": who}
