"""Figures 11 to 14: the model and the rig, each pair on identical axes, and where their peaks lie."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.reading.shown_record import SEGMENT_HZ, WINDOW_S, ShownRecord
from srbval.recordings import Origin
from srbval.report.blocks import Block, Explore, Figure, FigureGrid, Listing
from srbval.report.figures.acceleration import acceleration_panel
from srbval.report.figures.band import band_panel
from srbval.report.figures.scalogram import scalogram_panel
from srbval.report.figures.spectrum import envelope_spectrum_panel, fault_cursors, tall_peaks
from srbval.report.findings.findings import Evidence
from srbval.report.findings.shown_records import SCALOGRAM_ERROR, SCALOGRAM_HZ, SCALOGRAM_TRANSFORM
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import badge_of, side_of, synthetic_states
from srbval.report.table import Table
from srbval.signal import Scalogram

TEXTS, PAPER_SPEED = Texts("figures"), Texts("paper_speed")

SPECTRUM_HZ = 600.0  # Figures 12 and 13
SPECTRUM_FIGURES = {"12": Fault.OUTER, "13": Fault.INNER}
PANEL_LETTERS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
COLOUR_QUANTILE = 0.995  # top of the shared colour scale, so that one burst does not darken all the rest
HEAD_ROOM, LABEL_ROOM = 1.12, 1.4  # above the highest value on a shared axis, for the marks of found lines
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0  # of the spectra before demodulation: shown in all, above the highest level
Side = Mapping[Fault, ShownRecord]


def figures_section(evidence: Evidence) -> Section:
    """The sixteen panels, the tables of their peaks, and what draws Figure 14."""
    model, rig = evidence.shown["model"], evidence.shown["rig"]
    height_mm = 1e3 * evidence.runs["paper-inner"].scene.defect.height_m
    sides = [(side_of(record[Fault.INNER].analysis), evidence.sidebands[name])
             for name, record in (("model", model), ("rig", rig))]  # fmt: skip
    bands = {
        name: TEXTS.text("band", shown=side[Fault.OUTER].analysis.processed)
        for name, side in (("model", model), ("rig", rig))
    }
    again = [_again(model, rig, state) for state in model]
    spectra = [_spectrum_figure(number, model, rig) for number in SPECTRUM_FIGURES]
    peaks = [_peaks_table(number, model, rig) for number in SPECTRUM_FIGURES]
    return TEXTS.section(
        TEXTS.paragraph("intro", bands=bands, measured=evidence.measured_states),
        _figure_11(model, rig),
        *spectra,
        TEXTS.paragraph("sidebands", sides=sides, height_mm=height_mm),
        _figure_14(evidence),
        TEXTS.paragraph("readings", trains=evidence.trains),
        appendix=(
            _readings(evidence),
            TEXTS.table("impulse-trains", evidence.trains),
            _band_figure(evidence),
            *peaks,
            *_scalogram_checks(evidence),
            TEXTS.paragraph("once-more"),
            Listing(items=tuple(again)),
        ),
    )


def paper_speed_section(evidence: Evidence) -> Section:
    """The model's panels at the paper's own speed, with no rig recording to compare them with."""
    model = evidence.shown["paper"]
    limit = _largest(abs(record.acceleration) for record in model.values())
    spectra = [
        _spectrum_panel(f"fig{n}a-paper-speed", f"{n}a", state, model, model) for n, state in SPECTRUM_FIGURES.items()
    ]
    times = [
        _acceleration_panel(f"fig11{letters[0]}-paper-speed", f"11{letters[0]}", state, model, limit)
        for state, letters in PANEL_LETTERS.items()
    ]
    grids = (
        FigureGrid(figures=tuple(spectra), columns=2, label="Figures 12a and 13a at the paper's speed",
                   caption=TEXTS.text("grid-paper-spectra")),
        FigureGrid(figures=tuple(times), columns=2, label="Figure 11 (a, c, e) at the paper's speed",
                   caption=TEXTS.text("grid-paper-time")),
    )  # fmt: skip
    rpm = evidence.printed.shaft_rpm
    return PAPER_SPEED.section(appendix=(PAPER_SPEED.paragraph("intro", rpm=rpm), *grids), rpm=rpm)


def _band_figure(evidence: Evidence) -> FigureGrid:
    """Spectra of all states before demodulation, model above rig, with the bands that are demodulated."""
    sides = {name: evidence.shown[name] for name in ("model", "rig")}
    records = [record for side in sides.values() for record in side.values()]
    top = max(float(record.power_db.max()) for record in records) + BAND_HEAD_DB
    reach = max(float(record.power_hz[-1]) for record in records)
    panels = []
    for (name, side), letter in zip(sides.items(), "ab", strict=True):
        analysis = side[Fault.OUTER].analysis
        synthetic = synthetic_states({state: record.analysis for state, record in side.items()})
        origin, states = Origin.STAND_IN if synthetic else analysis.recording.origin, [s.label for s in side]
        band = analysis.processed.band_hz
        plot = partial(
            band_panel, frequency_hz=side[Fault.OUTER].power_hz,
            levels_db={state.label: record.power_db for state, record in side.items()}, band_hz=band,
            limits_db=(top - BAND_RANGE_DB, top), f_max_hz=reach, origin=origin.value, letter=letter,
        )  # fmt: skip
        figure = TEXTS.figure(
            "band", plot, id=f"band-{name}", badge=origin.value, side=name, band_hz=band, synthetic=synthetic,
            states=states,
        )  # fmt: skip
        explore = Explore(
            x="frequency_hz", x_label="Frequency, Hz", y_label="Power density, dB re 1/Hz",
            curves={state.replace(" ", "_") + "_db": state for state in states},
        )  # fmt: skip
        panels.append(dataclasses.replace(figure, explore=explore))
    return FigureGrid(
        figures=tuple(panels), columns=1, label="Before demodulation",
        caption=TEXTS.text("grid-band", resolution_hz=SEGMENT_HZ),
    )  # fmt: skip


def _figure_11(model: Side, rig: Side) -> FigureGrid:
    limit = _largest(abs(record.acceleration) for side in (model, rig) for record in side.values())
    panels = [
        _acceleration_panel(f"fig11{letter}", f"11{letter}", state, side, limit)
        for state, letters in PANEL_LETTERS.items()
        for side, letter in zip((model, rig), letters, strict=True)
    ]
    caption = TEXTS.text("grid-11", window_s=WINDOW_S)
    return FigureGrid(figures=tuple(panels), columns=2, label="Figure 11", caption=caption)


def _acceleration_panel(name: str, letter: str, state: Fault, side: Side, limit: float, reading: str = "") -> Figure:
    record = side[state]
    plot = partial(
        acceleration_panel, time_s=record.time_s, acceleration=record.acceleration, envelope=record.envelope,
        letter=letter[-1], window_s=WINDOW_S, y_limits=(-limit, limit), period_name=f"1/{state.line or ''}",
        period_s=1 / record.analysis.line(state.line).kinematic_hz if state.line else None,
        **_head(record, state, reading),
    )  # fmt: skip
    return TEXTS.figure("acceleration", plot, **_words(name, letter, record, state))


def _spectrum_figure(number: str, model: Side, rig: Side) -> FigureGrid:
    """Figure 12 or 13."""
    state = SPECTRUM_FIGURES[number]
    panels = [
        _spectrum_panel(f"fig{number}{letter}", f"{number}{letter}", state, side, other)
        for side, other, letter in ((model, rig, "a"), (rig, model, "b"))
    ]
    caption = TEXTS.text("grid-spectrum", state=state)
    return FigureGrid(figures=tuple(panels), columns=2, label=f"Figure {number}", caption=caption)


def _peaks_table(number: str, model: Side, rig: Side) -> Table:
    """Where the peaks of Figure 12 or 13 lie."""
    state = SPECTRUM_FIGURES[number]
    return TEXTS.table(f"peaks-{number}", _peaks(state, model[state].analysis, rig[state].analysis))


def _spectrum_panel(name: str, letter: str, state: Fault, side: Side, other: Side) -> Figure:
    record, line = side[state], state.line
    assert line is not None, "only the defects of races have a spectrum figure"
    shaft_hz = record.analysis.speed.value_hz
    cursors = fault_cursors(
        line, record.analysis.line(line).kinematic_hz, f_max_hz=SPECTRUM_HZ, sideband_hz=shaft_hz,
        sidebands=2 if state.sidebands else 0,
    )  # fmt: skip
    top = _largest(_shown_amplitudes(s[state]) for s in (side, other)) * LABEL_ROOM / HEAD_ROOM
    healthy, orders = side[Fault.HEALTHY], record.analysis.bearing.orders
    others = tall_peaks(
        record.frequency_hz, record.amplitude, shaft_hz=shaft_hz, f_max_hz=SPECTRUM_HZ,
        marked_hz=[*(c.frequency_hz for c in cursors), *(hz for peak, hz, _ in record.peaks if peak.startswith(line))],
        orders={"fr": 1.0, "BPFO": orders.bpfo, "BPFI": orders.bpfi, "2xBSF": 2 * orders.bsf, "FTF": orders.ftf},
    )  # fmt: skip
    plot = partial(
        envelope_spectrum_panel, frequency_hz=record.frequency_hz, amplitude=record.amplitude, shaft_hz=shaft_hz,
        cursors=cursors, letter=letter[-1],
        peaks=[(hz, height) for peak, hz, height in record.peaks if peak.startswith(line)],
        healthy=(healthy.frequency_hz, healthy.amplitude), f_max_hz=SPECTRUM_HZ, y_limits=(0.0, top), brief=True,
        others=others, **_head(record, state),
    )  # fmt: skip
    figure = TEXTS.figure("spectrum", plot, **_words(name, letter, record, state), f_max_hz=SPECTRUM_HZ)
    explore = Explore(
        x="frequency_hz",
        x_label="Frequency, Hz",
        y_label="Envelope amplitude, std. dev.",
        curves={"amplitude": state.label, "healthy_amplitude": "healthy"},
        marks=tuple((cursor.name, cursor.frequency_hz) for cursor in cursors),
        x_per_order=shaft_hz,
    )
    return dataclasses.replace(figure, explore=explore)


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
    found = [n for n in analysis.lines if (n.name, n.harmonic) == (wanted.name, wanted.harmonic)]
    peak: dict[str, Any] = {
        "found_hz": None,
        "ci95_hz": None,
        "badge": None,
        "order": None,
        "snr": None,
    }
    if found and found[0].detected and found[0].found_hz is not None:
        peak |= {
            "found_hz": found[0].found_hz,
            "ci95_hz": found[0].ci95_hz,
            "order": found[0].found_hz / analysis.speed.value_hz,
            "snr": found[0].snr,
            "badge": badge_of(analysis) if wanted.harmonic == 1 else None,
        }
    return peak


def _figure_14(evidence: Evidence) -> FigureGrid:
    images = [image for side in evidence.scalograms.values() for image in side.values()]
    top = float(np.quantile(np.concatenate([image.amplitude.ravel() for image in images]), COLOUR_QUANTILE))
    panels = [
        _scalogram_panel(letter, state, evidence, side, top)
        for state, letters in PANEL_LETTERS.items()
        for side, letter in zip(("model", "rig"), letters, strict=True)
    ]
    return FigureGrid(figures=tuple(panels), columns=2, label="Figure 14", caption=TEXTS.text("grid-14"))


def _scalogram_panel(letter: str, state: Fault, evidence: Evidence, side: str, top: float) -> Figure:
    record, image = evidence.shown[side][state], evidence.scalograms[side][state]
    return _image_panel(f"fig14{letter}", f"14{letter}", record, image, top, state=state)


def _image_panel(
    name: str, letter: str, record: ShownRecord, image: Scalogram, top: float, reading: str = "",
    state: Fault = Fault.OUTER,
) -> Figure:  # fmt: skip
    plot = partial(
        scalogram_panel, time_s=image.time_s + WINDOW_S[0],
        frequency_hz=image.frequency_hz, magnitude=image.amplitude, limits=(0.0, top), letter=letter[-1],
        window_s=WINDOW_S, edge_s=image.edge_s,
        period_s=1 / record.analysis.speed.value_hz if state.sidebands else None, period_name="1/fr",
        line_hz=record.analysis.line(state.line).kinematic_hz if state.line else None, line_name=state.line or "",
        **_head(record, state, reading),
    )  # fmt: skip
    return TEXTS.figure("scalogram", plot, **_words(name, letter, record, state), range_hz=SCALOGRAM_HZ)


def _readings(evidence: Evidence) -> FigureGrid:
    """Figures 11c and 14c in both readings of the rollers' diameter."""
    state, limit = Fault.OUTER, _largest(abs(record.acceleration) for record, _ in evidence.fits.values())
    top = float(np.quantile([image.amplitude for _, image in evidence.fits.values()], COLOUR_QUANTILE))
    times, images = [], []
    for fit, (record, image) in evidence.fits.items():
        head = TEXTS.text("fit", fit=fit.value)
        times.append(_acceleration_panel(f"fig11c-{fit.value}", "11c", state, {state: record}, limit, head))
        images.append(_image_panel(f"fig14c-{fit.value}", "14c", record, image, top, head))
    caption = TEXTS.text("grid-readings")
    return FigureGrid(
        figures=(*times, *images), columns=2, label="Figures 11c and 14c, two readings", caption=caption
    )  # fmt: skip


def _scalogram_checks(evidence: Evidence) -> Iterator[Block]:
    transforms = evidence.results.content("reading_accuracy").get("transforms")
    if transforms:
        yield TEXTS.table(
            "scalogram-checks", transforms, command="srbval study run reading_accuracy", allowed=SCALOGRAM_ERROR,
            drawn_by=SCALOGRAM_TRANSFORM,
        )  # fmt: skip


def _head(record: ShownRecord, state: Fault, reading: str = "") -> dict[str, Any]:
    """What heads a panel: the origin of its signal and its title, or the `reading` that it shows."""
    title = reading or f"{state.label}, {60 * record.analysis.speed.value_hz:.4g} rpm"
    return {"origin": record.analysis.recording.origin.value, "title": title}


def _words(name: str, letter: str, record: ShownRecord, state: Fault) -> dict[str, Any]:
    """What caption and alt text of a panel are made of."""
    analysis = record.analysis
    rpm = 60 * analysis.speed.value_hz
    return {
        "id": name,
        "letter": letter,
        "badge": badge_of(analysis),
        "state": state,
        "who": TEXTS.text("who", side=side_of(analysis), state=state, rpm=rpm),
    }


def _again(model: Side, rig: Side, state: Fault) -> str:
    """The commands that make a pair of panels again."""
    own, other = model[state].analysis, rig[state].analysis.recording
    file = Path(other.file).name if other.file and other.origin is Origin.MEASURED else ""
    return TEXTS.text("again", state=state, rpm=60 * own.speed.value_hz, model=own, file=file)


def _shown_amplitudes(record: ShownRecord) -> FloatArray:
    """Amplitudes in the range shown, above the slow trend at its very start."""
    return record.amplitude[(record.frequency_hz > 1.0) & (record.frequency_hz <= SPECTRUM_HZ)]


def _largest(parts: Iterable[FloatArray]) -> float:
    return HEAD_ROOM * max(float(part.max()) for part in parts)
