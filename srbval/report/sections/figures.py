"""Figures 11 to 14: the model and the rig, each pair on identical axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.report.blocks import Explore, Figure, Section
from srbval.report.figures.images import scalogram_panel
from srbval.report.figures.signals import acceleration_panel, spectrum_panel
from srbval.report.findings import records
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordView, badge_of, side_of
from srbval.report.prose import Prose
from srbval.signal.spectrum import SCALOGRAM_HZ

TEXTS = Prose("srbval.report", "texts/figures.md")

SPECTRUM_HZ = 600.0  # Figures 12 and 13
SPECTRUM_FIGURES = {"12": Fault.OUTER, "13": Fault.INNER}
LETTERS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
COLOUR_QUANTILE = 0.995  # top of the shared colour scale, so that one burst does not darken all the rest
HEAD_ROOM, LABEL_ROOM = 1.12, 1.4  # above the highest value on a shared axis, for the marks of found lines
Side = Mapping[Fault, RecordView]


def figures_section(findings: Findings) -> Section:
    """The sixteen panels, and what the sidebands of the inner race show."""
    sides = findings.views
    model, rig = sides["model"], sides["rig"]
    places = [
        (*one, state) for state, letters in LETTERS.items() for one in zip(("model", "rig"), letters, strict=True)
    ]
    burst = HEAD_ROOM * max(float(abs(one.acceleration).max()) for side in sides.values() for one in side.values())
    pixels = [image.amplitude.ravel() for side in findings.scalograms.values() for image in side.values()]
    brightest = float(np.quantile(np.concatenate(pixels), COLOUR_QUANTILE))
    times, images = list[Figure](), list[Figure]()
    for side, letter, state in places:
        record, image = sides[side][state], findings.scalograms[side][state]
        title = f"{state.label}, {60 * record.shaft_hz:.4g} rpm"
        period = (f"1/{state.line}", 1 / record.analysis.line(state.line).kinematic_hz) if state.line else None
        plot = acceleration_panel(record, limit=burst, letter=letter, title=title, period=period)
        times.append(TEXTS.figure("acceleration", plot, **_words(f"11{letter}", record, state)))
        plot = scalogram_panel(record, image, state, top=brightest, letter=letter, title=title)
        words = _words(f"14{letter}", record, state) | dict(zip(("low_hz", "high_hz"), SCALOGRAM_HZ, strict=True))
        images.append(TEXTS.figure("scalogram", plot, **words))
    spectra = []
    for number, state in SPECTRUM_FIGURES.items():
        panels = [_spectrum_panel(f"{number}a", state, model, rig), _spectrum_panel(f"{number}b", state, rig, model)]
        spectra.append(TEXTS.grid(f"grid-{number}", panels, f"Figure {number}", state=state.label))
    shares = {side_of(sides[name][Fault.INNER].analysis): share for name, share in findings.data["sidebands"].items()}
    return TEXTS.section(
        TEXTS.paragraph("intro", model_band=_band(model), rig_band=_band(rig)),
        TEXTS.grid("grid-11", times, "Figure 11", window_ms=1e3 * (records.WINDOW_S[1] - records.WINDOW_S[0])),
        *spectra,
        TEXTS.paragraph(
            "sidebands",
            shares=sidebands_sentence(shares),
            height_mm=1e3 * findings.runs["paper-inner"].scene.defect.height_m,
        ),
        TEXTS.grid("grid-14", images, "Figure 14"),
    )


def sidebands_sentence(shares: Mapping[str, Mapping[str, float] | None]) -> str:
    """Shares of the sidebands at one and two shaft speeds for each side, if its line was read."""
    return "; ".join(
        f"{side}: {share['at_one']:.2f} at one shaft speed, {share['at_two']:.2f} at two"
        if share
        else f"{side}: line not read"
        for side, share in shares.items()
    )


def _band(side: Side) -> str:
    low, high = side[Fault.OUTER].analysis.processed.band_hz
    return f"{low:g} to {high:g}"


def _spectrum_panel(letter: str, state: Fault, side: Side, other: Side) -> Figure:
    record, line = side[state], state.line
    assert line is not None, "only the defects of races have a spectrum figure"
    shaft_hz, orders = record.shaft_hz, record.analysis.bearing.orders
    line_hz = record.analysis.line(line).kinematic_hz
    cursors = records.fault_cursors(
        line, line_hz, SPECTRUM_HZ, sideband_hz=shaft_hz, sidebands=2 if state.sidebands else 0
    )
    found = tuple((hz, height) for n, hz, height in record.peaks if n.startswith(line))
    others = records.tall_peaks(
        record.frequency_hz,
        record.amplitude,
        SPECTRUM_HZ,
        shaft_hz=shaft_hz,
        marked_hz=[*(cursor.frequency_hz for cursor in cursors), *(hz for hz, _ in found)],
        orders={"fr": 1.0, "BPFO": orders.bpfo, "BPFI": orders.bpfi, "2xBSF": 2 * orders.bsf, "FTF": orders.ftf},
    )
    view = records.SpectrumView(
        record=record, healthy=side[Fault.HEALTHY], cursors=cursors, peaks=found, end_hz=SPECTRUM_HZ, others=others
    )
    top = LABEL_ROOM * max(records.highest_of(one[state], SPECTRUM_HZ) for one in (side, other))
    title = f"{state.label}, {60 * record.shaft_hz:.4g} rpm"
    plot = spectrum_panel(view, top=top, letter=letter[-1], title=title, brief=True)
    curves = {"amplitude": state.label, "healthy_amplitude": "healthy"}
    words = _words(letter, record, state) | {"explore": explore_spectrum(view, "Envelope amplitude, std. dev.", curves)}
    return TEXTS.figure("spectrum", plot, **words, line=line, end_hz=SPECTRUM_HZ)


def explore_spectrum(view: records.SpectrumView, y_label: str, curves: Mapping[str, str]) -> Explore:
    """Chart of an envelope spectrum for scripts; `curves` names the columns of its data file."""
    return Explore(
        x="frequency_hz",
        x_label="Frequency, Hz",
        y_label=y_label,
        curves=curves,
        marks=tuple((cursor.name, cursor.frequency_hz) for cursor in view.cursors),
        x_per_order=view.record.shaft_hz,
    )


def _words(letter: str, record: RecordView, state: Fault) -> dict[str, Any]:
    return panel_words(f"fig{letter}", f"Figure {letter}", record, state)


def panel_words(name: str, label: str, record: RecordView, state: Fault) -> dict[str, Any]:
    """Id, badge and the words of a panel's caption and alt text."""
    what = "healthy bearing" if state is Fault.HEALTHY else f"{state.label} defect"
    who = f"{side_of(record.analysis)}, {what}, {60 * record.shaft_hz:.2f} rpm"
    return {"id": name, "label": label, "badge": badge_of(record.analysis), "who": who}
