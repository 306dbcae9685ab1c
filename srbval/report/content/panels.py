"""Figures 11 to 14: the model beside the rig, each pair on identical axes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.bench.scalogram_check import TRANSFORMS
from srbval.recordings import Origin
from srbval.report.blocks import Explore, Figure, FigureGrid
from srbval.report.content.names import SIDE_NAME, badge_of, rpm_of
from srbval.report.content.scalogram_checks import Window, choose_transform
from srbval.report.figures import acceleration_panel, envelope_spectrum_panel, fault_cursors, scalogram_panel
from srbval.report.inline import literal
from srbval.signal import Scalogram
from srbval.signal.scalogram import COLUMNS, ROWS
from srbval.validation.analyse import Analysis

FloatArray = NDArray[np.float64]

WINDOW_S = (0.3, 0.5)  # shown in Figures 11 and 14: two to three shaft turns, clear of the filter's ends
SPECTRUM_HZ = 600.0  # Figures 12 and 13
SCALOGRAM_HZ = (40.0, 1000.0)  # Figure 14: from below the race lines to their high harmonics
PAIRS = {Fault.HEALTHY: "ab", Fault.OUTER: "cd", Fault.INNER: "ef"}
COLOUR_QUANTILE = 0.995  # top of the shared colour scale, so that one burst does not darken all the rest
HEAD_ROOM, LABEL_ROOM = 1.12, 1.4  # above the highest value on a shared axis, for the marks of found lines


@dataclass(frozen=True, kw_only=True)
class Side:
    """One column of the figures: its analyses by state."""

    analyses: Mapping[Fault, Analysis]

    def scaled(self, state: Fault) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Time [s], band-passed acceleration and envelope in standard deviations of the former."""
        shown = self.analyses[state].processed
        spread = float(np.std(shown.filtered))
        time = np.arange(len(shown.filtered)) / shown.fs_hz
        return time, shown.filtered / spread, shown.envelope / spread

    def spectrum(self, state: Fault) -> tuple[FloatArray, FloatArray]:
        """Frequency [Hz] and envelope amplitude in standard deviations of the band-passed signal."""
        shown = self.analyses[state].processed
        return shown.spectrum.frequency_hz, shown.spectrum.amplitude / float(np.std(shown.filtered))

    def scalogram(self, state: Fault) -> Scalogram:
        """Wavelet transform of the envelope in the window, in the same unit; its ends are hatched in the picture."""
        time, _, strength = self.scaled(state)
        part = strength[_inside(time)]
        transform = TRANSFORMS[choose_transform(self.scalogram_window(state)).transform]
        return transform(
            part - part.mean(), self.analyses[state].processed.fs_hz, range_hz=SCALOGRAM_HZ, rows=ROWS, columns=COLUMNS
        )

    def scalogram_window(self, state: Fault) -> Window:
        """Samples in the window, their rate and the rows' range: what a transform is tried on."""
        inside = _inside(self.scaled(state)[0])
        return int(np.count_nonzero(inside)), self.analyses[state].processed.fs_hz, SCALOGRAM_HZ


def figures_11_to_14(model: Side, rig: Side, folder: Path) -> list[FigureGrid]:
    """The sixteen panels; (a, c, e) model, (b, d, f) rig."""
    return [
        _figure_11(model, rig, folder),
        _spectrum_figure("12", Fault.OUTER, model, rig, folder),
        _spectrum_figure("13", Fault.INNER, model, rig, folder),
        _figure_14(model, rig, folder),
    ]


def model_alone(model: Side, folder: Path) -> list[FigureGrid]:
    """The model's panels at the paper's own speed, with no rig recording beside them."""
    spectra = [
        _spectrum_panel(f"fig{n}a-paper-speed", f"{n}a", state, model, model, folder)
        for n, state in (("12", Fault.OUTER), ("13", Fault.INNER))
    ]
    limit = _largest(abs(model.scaled(s)[1][_inside(model.scaled(s)[0])]) for s in PAIRS)
    time = [
        _acceleration_panel(f"fig11{PAIRS[s][0]}-paper-speed", f"11{PAIRS[s][0]}", s, model, limit, folder)
        for s in PAIRS
    ]
    return [
        FigureGrid(figures=tuple(spectra), columns=1, label="Figures 12a and 13a at the paper's speed",
                   caption="Envelope spectra of the model over the full run."),
        FigureGrid(figures=tuple(time), columns=2, label="Figure 11 (a, c, e) at the paper's speed",
                   caption="Band-passed acceleration of the model and its envelope."),
    ]  # fmt: skip


def _figure_11(model: Side, rig: Side, folder: Path) -> FigureGrid:
    limit = _largest(abs(s.scaled(k)[1][_inside(s.scaled(k)[0])]) for s in (model, rig) for k in PAIRS)
    panels = [
        _acceleration_panel(f"fig11{letter}", f"11{letter}", state, side, limit, folder)
        for state, letters in PAIRS.items()
        for side, letter in zip((model, rig), letters, strict=True)
    ]
    return FigureGrid(
        figures=tuple(panels),
        columns=2,
        label="Figure 11",
        caption="Acceleration and its envelope, band-passed, in standard deviations of the band-passed record. "
        "Left the model, right the rig side; all panels on the same axes. " + _again(model, rig, Fault.HEALTHY),
    )


def _acceleration_panel(
    name: str, letter: str, state: Fault, side: Side, limit: float, folder: Path
) -> Figure:  # fmt: skip
    analysis = side.analyses[state]
    time, signal, strength = side.scaled(state)
    line = state.line
    period = None if line is None else 1 / analysis.line(line).kinematic_hz
    files = acceleration_panel(
        folder, name, time_s=time, acceleration=signal, envelope=strength,
        origin=analysis.recording.origin.value, letter=letter[-1], title=_title(analysis, state),
        window_s=WINDOW_S, y_limits=(-limit, limit), period_s=period, period_name=f"1/{line}" if line else "",
    )  # fmt: skip
    return _figure(
        name, letter, analysis, files.picture, files.data,
        f"{_who(analysis, state)}; {_band(analysis)}, {1e3 * (WINDOW_S[1] - WINDOW_S[0]):.0f} ms of "
        f"{analysis.recording.seconds:.3g} s.",
        f"Acceleration over time with its envelope, {_who(analysis, state)}.",
    )  # fmt: skip


def _spectrum_figure(number: str, state: Fault, model: Side, rig: Side, folder: Path) -> FigureGrid:
    panels = [
        _spectrum_panel(f"fig{number}{letter}", f"{number}{letter}", state, side, other, folder)
        for side, other, letter in ((model, rig, "a"), (rig, model, "b"))
    ]
    return FigureGrid(
        figures=tuple(panels),
        columns=1,
        label=f"Figure {number}",
        caption=f"Envelope spectra, {state.label} defect, on the same axes, with the healthy bearing of the "
        "same side dashed. Green: kinematic fault lines and their sidebands (fr: shaft speed), in Hz and shaft orders; "
        "triangles: lines that were read and detected. " + _again(model, rig, state),
    )


def _spectrum_panel(name: str, letter: str, state: Fault, side: Side, other: Side, folder: Path) -> Figure:
    analysis = side.analyses[state]
    line = state.line or ""
    shaft_hz = analysis.speed.value_hz
    frequency, amplitude = side.spectrum(state)
    top = _largest(_below(*s.spectrum(state)) for s in (side, other)) * LABEL_ROOM / HEAD_ROOM
    cursors = fault_cursors(
        line, analysis.line(line).kinematic_hz, f_max_hz=SPECTRUM_HZ, sideband_hz=shaft_hz,
        sidebands=2 if state is Fault.INNER else 0,
    )  # fmt: skip
    peaks = [
        (n.found_hz, _height_at(n.found_hz, frequency, amplitude))
        for n in analysis.lines
        if n.detected and n.found_hz is not None and n.name.startswith(line)
    ]
    files = envelope_spectrum_panel(
        folder, name, frequency_hz=frequency, amplitude=amplitude, shaft_hz=shaft_hz,
        origin=analysis.recording.origin.value, cursors=cursors, peaks=peaks,
        healthy=side.spectrum(Fault.HEALTHY), letter=letter[-1], title=_title(analysis, state),
        f_max_hz=SPECTRUM_HZ, y_limits=(0.0, top),
    )  # fmt: skip
    resolution = analysis.processed.spectrum.resolution_hz
    figure = _figure(
        name, letter, analysis, files.picture, files.data,
        f"{_who(analysis, state)}; {_band(analysis)}, resolution {resolution:.3g} Hz. {literal(analysis.verdict)}",
        f"Envelope spectrum up to {SPECTRUM_HZ:.0f} Hz with {line} and its harmonics marked, {_who(analysis, state)}.",
    )  # fmt: skip
    return dataclasses.replace(
        figure,
        explore=Explore(
            x="frequency_hz",
            x_label="Frequency, Hz",
            y_label="Envelope amplitude, std. dev.",
            curves={"amplitude": state.label, "healthy_amplitude": "healthy"},
            marks=tuple((c.name, c.frequency_hz) for c in cursors),
            x_per_order=shaft_hz,
        ),
    )


def _figure_14(model: Side, rig: Side, folder: Path) -> FigureGrid:
    images = {(id(side), s): side.scalogram(s) for side in (model, rig) for s in PAIRS}
    top = float(np.quantile(np.concatenate([i.amplitude.ravel() for i in images.values()]), COLOUR_QUANTILE))
    panels = []
    for state, letters in PAIRS.items():
        for side, letter in zip((model, rig), letters, strict=True):
            panels.append(_scalogram_panel(letter, state, side, images[id(side), state], top, folder))
    return FigureGrid(
        figures=tuple(panels),
        columns=2,
        label="Figure 14",
        caption="Magnitude of the continuous wavelet transform (complex Morlet) of the envelope; one colour scale for "
        "all panels. Hatched: the cone of influence, where a row also sees the ends. Drawn by the transform that "
        "passes the tests of unit tones and impulses at every scale; see the table below.",
    )


def _scalogram_panel(
    letter: str, state: Fault, side: Side, image: Scalogram, top: float, folder: Path
) -> Figure:  # fmt: skip
    analysis = side.analyses[state]
    line = state.line
    expected = None if line is None else analysis.line(line).kinematic_hz
    files = scalogram_panel(
        folder, f"fig14{letter}", time_s=image.time_s + WINDOW_S[0],
        frequency_hz=image.frequency_hz, magnitude=image.amplitude, limits=(0.0, top),
        origin=analysis.recording.origin.value, letter=letter, title=_title(analysis, state),
        window_s=WINDOW_S, edge_s=image.edge_s, record_s=WINDOW_S,
        period_s=1 / analysis.speed.value_hz if state is Fault.INNER else None,
        period_name="1/fr", line_hz=expected, line_name=line or "",
    )  # fmt: skip
    return _figure(
        f"fig14{letter}", f"14{letter}", analysis, files.picture, files.data,
        f"{_who(analysis, state)}; {_band(analysis)}.",
        f"Scalogram of the envelope from {SCALOGRAM_HZ[0]:.0f} to {SCALOGRAM_HZ[1]:.0f} Hz, {_who(analysis, state)}.",
    )  # fmt: skip


def _figure(
    name: str, letter: str, analysis: Analysis, picture: Path, data: Path, caption: str, alt: str
) -> Figure:  # fmt: skip
    return Figure(
        id=name, label=f"Figure {letter}", caption=caption, alt=alt, file=picture, data=data,
        badge=badge_of(analysis), synthetic=analysis.recording.origin is Origin.STAND_IN,
    )  # fmt: skip


def _again(model: Side, rig: Side, state: Fault) -> str:
    """The commands that make a pair of panels again."""
    own, other = model.analyses[state], rig.analyses[state].recording
    file = Path(other.file).name if other.file and other.origin is Origin.MEASURED else ""
    named = f"; rig: `srbval analyse` {literal(file)}" if file else ""
    return (
        f"Once more, model: `srbval simulate --defect {state.scene_word} --rpm {rpm_of(own):.4f} --seconds "
        f"{own.recording.seconds:.4g} -o run.h5`, then `srbval analyse run.h5`{named}."
    )


def _title(analysis: Analysis, state: Fault) -> str:
    return f"{state.label}, {rpm_of(analysis):.4g} rpm"


def _who(analysis: Analysis, state: Fault) -> str:
    what = "healthy bearing" if state is Fault.HEALTHY else f"{state.label} defect"
    return f"{SIDE_NAME[analysis.recording.origin]}, {what}, shaft {rpm_of(analysis):.2f} rpm ({analysis.speed.source})"


def _band(analysis: Analysis) -> str:
    shown = analysis.processed
    low, high = shown.band_hz
    return (
        f"band {low:g} to {high:g} Hz ({shown.band_filter.value}), envelope (modulus) in standard deviations of the "
        "band-passed signal"
    )


def _inside(time: FloatArray) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = (time >= WINDOW_S[0]) & (time <= WINDOW_S[1])
    return inside


def _height_at(line_hz: float, frequency: FloatArray, amplitude: FloatArray) -> float:
    """Height of a line: the larger of the two bins it lies between."""
    return float(amplitude[np.argsort(np.abs(frequency - line_hz))[:2]].max())


def _below(frequency: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Amplitudes in the shown range, above the slow trend at its very start."""
    return amplitude[(frequency > 1.0) & (frequency <= SPECTRUM_HZ)]


def _largest(parts: Iterable[FloatArray]) -> float:
    return HEAD_ROOM * max(float(part.max()) for part in parts)
