"""Figures 11 to 14: the model and the rig, each pair on identical axes, and where their peaks lie."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.recordings import Origin
from srbval.report.blocks import Explore, Figure, FigureGrid, Listing, Section
from srbval.report.figures.images import scalogram_panel
from srbval.report.figures.signals import acceleration_panel, band_panel, spectrum_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import (
    SEGMENT_HZ,
    WINDOW_S,
    RecordView,
    SpectrumView,
    fault_cursors,
    highest_of,
    tall_peaks,
)
from srbval.report.section_texts import Texts, badge_of, side_of
from srbval.signal import Scalogram
from srbval.signal.spectrum import SCALOGRAM_HZ

TEXTS = Texts("figures")

SPECTRUM_HZ = 600.0  # Figures 12 and 13
SPECTRUM_FIGURES = {"12": Fault.OUTER, "13": Fault.INNER}
PANEL_LETTERS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
COLOUR_QUANTILE = 0.995  # top of the shared colour scale, so that one burst does not darken all the rest
HEAD_ROOM, LABEL_ROOM = 1.12, 1.4  # above the highest value on a shared axis, for the marks of found lines
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0  # of the spectra before demodulation: shown in all, above the highest level
Side = Mapping[Fault, RecordView]


def figures_section(findings: Findings) -> Section:
    """The sixteen panels, the tables of their peaks, and what draws Figure 14."""
    model, rig = findings.views["model"], findings.views["rig"]
    height_mm = 1e3 * findings.runs["paper-inner"].scene.defect.height_m
    sides = {"model": model, "rig": rig}
    bands = {name: TEXTS.text("band", shown=side[Fault.OUTER].analysis.processed) for name, side in sides.items()}
    shares = [(side_of(side[Fault.INNER].analysis), findings.data["sidebands"][name]) for name, side in sides.items()]
    places = [
        (side, letter, state)
        for state, letters in PANEL_LETTERS.items()
        for side, letter in zip(sides, letters, strict=True)
    ]
    burst = HEAD_ROOM * max(float(abs(one.acceleration).max()) for side in sides.values() for one in side.values())
    pixels = [image.amplitude.ravel() for side in findings.scalograms.values() for image in side.values()]
    brightest = float(np.quantile(np.concatenate(pixels), COLOUR_QUANTILE))
    times = [_time_panel(f"fig11{c}", f"11{c}", state, sides[side][state], burst) for side, c, state in places]
    images = [
        _image_panel(f"fig14{c}", f"14{c}", state, sides[side][state], findings.scalograms[side][state], brightest)
        for side, c, state in places
    ]
    return TEXTS.section(
        TEXTS.paragraph("intro", bands=bands),
        TEXTS.grid("grid-11", times, "Figure 11", window_s=WINDOW_S),
        *(_spectrum_figure(number, model, rig) for number in SPECTRUM_FIGURES),
        TEXTS.paragraph("sidebands", sides=shares, height_mm=height_mm),
        TEXTS.grid("grid-14", images, "Figure 14"),
        appendix=(
            _band_figure(sides),
            *(
                TEXTS.table(f"peaks-{number}", _peaks(state, model[state].analysis, rig[state].analysis))
                for number, state in SPECTRUM_FIGURES.items()
            ),
            TEXTS.paragraph("once-more"),
            Listing(tuple(_again(model, rig, state) for state in model)),
        ),
    )


def _band_figure(sides: Mapping[str, Side]) -> FigureGrid:
    """Spectra of all states before demodulation, model above rig, with the bands that are demodulated."""
    records = [record for side in sides.values() for record in side.values()]
    top = max(float(record.power_db.max()) for record in records) + BAND_HEAD_DB
    reach = max(float(record.power_hz[-1]) for record in records)
    panels = []
    for (name, side), letter in zip(sides.items(), "ab", strict=True):
        analysis = side[Fault.OUTER].analysis
        origin, states = analysis.recording.origin, [s.label for s in side]
        plot = band_panel(records={state.label: record for state, record in side.items()},
            limits_db=(top - BAND_RANGE_DB, top), end_hz=reach, letter=letter,
        )  # fmt: skip
        explore = Explore(
            x="frequency_hz", x_label="Frequency, Hz", y_label="Power density, dB re 1/Hz",
            curves={state.replace(" ", "_") + "_db": state for state in states},
        )  # fmt: skip
        panels.append(TEXTS.figure(
            "band", plot, id=f"band-{name}", badge=origin.value, side=name, band_hz=analysis.processed.band_hz,
            states=states, explore=explore,
        ))  # fmt: skip
    return TEXTS.grid("grid-band", panels, "Before demodulation", columns=1, resolution_hz=SEGMENT_HZ)


def _time_panel(name: str, letter: str, state: Fault, record: RecordView, limit: float) -> Figure:
    period = (f"1/{state.line}", 1 / record.analysis.line(state.line).kinematic_hz) if state.line else None
    plot = acceleration_panel(record, limit=limit, letter=letter[-1], title=_title(record, state), period=period)
    return TEXTS.figure("acceleration", plot, **_words(name, letter, record, state))


def _spectrum_figure(number: str, model: Side, rig: Side) -> FigureGrid:
    """Figure 12 or 13."""
    state = SPECTRUM_FIGURES[number]
    panels = [
        _spectrum_panel(f"fig{number}{letter}", f"{number}{letter}", state, side, other)
        for side, other, letter in ((model, rig, "a"), (rig, model, "b"))
    ]
    return TEXTS.grid("grid-spectrum", panels, f"Figure {number}", state=state)


def _spectrum_panel(name: str, letter: str, state: Fault, side: Side, other: Side) -> Figure:
    record, line = side[state], state.line
    assert line is not None, "only the defects of races have a spectrum figure"
    shaft_hz, orders = record.shaft_hz, record.analysis.bearing.orders
    line_hz = record.analysis.line(line).kinematic_hz
    cursors = fault_cursors(
        line, line_hz, SPECTRUM_HZ, sideband_hz=shaft_hz, sidebands=2 if state.sidebands else 0
    )  # fmt: skip
    found = tuple((hz, height) for n, hz, height in record.peaks if n.startswith(line))
    others = tall_peaks(
        record.frequency_hz, record.amplitude, SPECTRUM_HZ, shaft_hz=shaft_hz,
        marked_hz=[*(cursor.frequency_hz for cursor in cursors), *(hz for hz, _ in found)],
        orders={"fr": 1.0, "BPFO": orders.bpfo, "BPFI": orders.bpfi, "2xBSF": 2 * orders.bsf, "FTF": orders.ftf},
    )  # fmt: skip
    view = SpectrumView(
        record=record, healthy=side[Fault.HEALTHY], cursors=cursors, peaks=found, end_hz=SPECTRUM_HZ, others=others
    )
    top = LABEL_ROOM * max(highest_of(one[state], SPECTRUM_HZ) for one in (side, other))
    plot = spectrum_panel(view, top=top, letter=letter[-1], title=_title(record, state), brief=True)
    curves = {"amplitude": state.label, "healthy_amplitude": "healthy"}
    explore = explore_spectrum(view, "Envelope amplitude, std. dev.", curves)
    words = _words(name, letter, record, state)
    return TEXTS.figure("spectrum", plot, **words, f_max_hz=SPECTRUM_HZ, explore=explore)


def explore_spectrum(view: SpectrumView, y_label: str, curves: Mapping[str, str]) -> Explore:
    """How scripts show an envelope spectrum again; `curves` names the columns of its data file."""
    return Explore(
        x="frequency_hz", x_label="Frequency, Hz", y_label=y_label, curves=curves,
        marks=tuple((cursor.name, cursor.frequency_hz) for cursor in view.cursors), x_per_order=view.record.shaft_hz,
    )  # fmt: skip


def _peaks(state: Fault, model: Analysis, rig: Analysis) -> Iterator[dict[str, Any]]:
    """One row per line of the state's family, on both sides."""
    for line in model.lines:
        if line.name.startswith(state.line or ""):
            yield {
                "name": line.name if line.harmonic == 1 else f"{line.harmonic}x{line.name}",
                "kinematic_order": line.kinematic_hz / model.speed.value_hz,
                "model": _peak(line, model),
                "rig": _peak(line, rig),
            }


def _peak(wanted: Line, analysis: Analysis) -> dict[str, Any]:
    for line in analysis.lines:
        if (line.name, line.harmonic) == (wanted.name, wanted.harmonic) and line.detected and line.found_hz is not None:
            return {
                "found_hz": line.found_hz, "ci95_hz": line.ci95_hz, "order": line.found_hz / analysis.speed.value_hz,
                "snr": line.snr, "badge": badge_of(analysis) if wanted.harmonic == 1 else None,
            }  # fmt: skip
    return dict.fromkeys(("found_hz", "ci95_hz", "order", "snr", "badge"))


def _image_panel(name: str, letter: str, state: Fault, record: RecordView, image: Scalogram, top: float) -> Figure:
    plot = scalogram_panel(record, image, state, top=top, letter=letter[-1], title=_title(record, state))
    return TEXTS.figure("scalogram", plot, **_words(name, letter, record, state), range_hz=SCALOGRAM_HZ)


def _title(record: RecordView, state: Fault) -> str:
    return f"{state.label}, {60 * record.shaft_hz:.4g} rpm"


def _words(name: str, letter: str, record: RecordView, state: Fault) -> dict[str, Any]:
    """What caption and alt text of a panel are made of."""
    who = TEXTS.text("who", side=side_of(record.analysis), state=state, rpm=60 * record.shaft_hz)
    return {"id": name, "letter": letter, "badge": badge_of(record.analysis), "state": state, "who": who}


def _again(model: Side, rig: Side, state: Fault) -> str:
    """The commands that make a pair of panels again."""
    own, other = model[state].analysis, rig[state].analysis.recording
    file = Path(other.file).name if other.file and other.origin is Origin.MEASURED else ""
    return TEXTS.text("again", state=state, rpm=60 * own.speed.value_hz, model=own, file=file)
