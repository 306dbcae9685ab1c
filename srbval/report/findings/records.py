"""Arrays of a record for figures: signal and envelope over time, spectra with the lines to mark, scalogram."""

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line, detected_fault_lines
from srbval.reading.pipeline import one_signal
from srbval.recordings import Origin, Recording
from srbval.recordings.registry import RecordSource, recording_of
from srbval.signal import Scalogram, morlet_scalogram, power_density
from srbval.signal.spectrum import SCALOGRAM_HZ

WINDOW_S = (0.3, 0.5)  # of Figures 11 and 14: two to three shaft turns, away from the filter's ends
WINDOW_TURNS = 3.0  # shaft turns drawn of any other record: a dozen impacts of a race fault or more
SEGMENT_HZ = 20.0  # resolution of the Welch spectra: fine enough for resonances, coarse enough to smooth the rest
OWN_UNITS, NORMALISED = {"m/s2": "m/s²", "mm/s": "mm/s", "um": "µm"}, "std. dev."  # by the recording's unit
# Amplitudes below this frequency, or below this order of a slow shaft, are slow trends and not spectral lines.
MIN_SPECTRUM_HZ, MIN_SPECTRUM_ORDER = 1.0, 0.3
MARKED_SPAN, RACES_SPAN = 4.4, 2.3  # end of a plotted spectrum: times the marked line, otherwise times BPFI
BAND_EDGE_FACTOR = 2 ** (1 / 6)  # edges of the one-third-octave band about a line, as factors


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordView:
    """Arrays of one record that figures draw.

    Amplitudes are in `unit`: the record's own unit, or standard deviations of the band-passed signal. `time_s`,
    `acceleration` and `envelope`, shape [n], cover only `window_s`. `frequency_hz` and `amplitude`, shape [m], are the
    envelope spectrum; `peaks` are name, frequency [Hz] and amplitude of its detected lines. `power_hz` and `power_db`
    [dB re 1/Hz], shape [k], are a Welch spectrum before demodulation.
    """

    analysis: Analysis
    unit: str
    window_s: tuple[float, float]
    time_s: FloatArray
    acceleration: FloatArray
    envelope: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    peaks: tuple[tuple[str, float, float], ...]
    power_hz: FloatArray
    power_db: FloatArray

    @property
    def origin(self) -> Origin:
        """Origin of the record: measured, simulated or a synthetic stand-in."""
        return self.analysis.recording.origin

    @property
    def shaft_hz(self) -> float:
        """Mean shaft speed [Hz]."""
        return self.analysis.speed.value_hz

    @cached_property
    def scalogram(self) -> Scalogram:
        """Wavelet transform of the envelope in the time window that figures show."""
        envelope, fs_hz = self.envelope - self.envelope.mean(), self.analysis.processed.fs_hz
        return morlet_scalogram(envelope, fs_hz, range_hz=SCALOGRAM_HZ)

    @property
    def highest(self) -> float:
        """Largest magnitude of signal and envelope in the time window."""
        return float(max(np.abs(self.acceleration).max(), self.envelope.max()))


def record_view(analysis: Analysis, *, window_s: tuple[float, float] = WINDOW_S, own_unit: bool = False) -> RecordView:
    """Prepare an analysed record for figures; amplitudes are in standard deviations, or in its unit if `own_unit`."""
    shown = analysis.processed
    spread, scale = (1 / shown.scale, shown.scale) if own_unit else (float(np.std(shown.filtered)), 1.0)
    time = np.arange(len(shown.filtered)) / shown.fs_hz
    inside = (time >= window_s[0]) & (time <= window_s[1])
    power_hz, power = power_density(shown.samples * scale, shown.fs_hz, 1 / SEGMENT_HZ)
    return RecordView(
        analysis=analysis,
        unit=OWN_UNITS[analysis.recording.unit] if own_unit else NORMALISED,
        window_s=window_s,
        time_s=time[inside],
        acceleration=shown.filtered[inside] / spread,
        envelope=shown.envelope[inside] / spread,
        frequency_hz=shown.spectrum.frequency_hz,
        amplitude=shown.spectrum.amplitude / spread,
        peaks=tuple(
            (line.name, line.found_hz, shown.spectrum.height_at(line.found_hz) / spread)
            for line in analysis.lines
            if line.detected and line.found_hz is not None
        ),
        power_hz=power_hz[1:],
        power_db=10 * np.log10(np.maximum(power[1:], np.finfo(float).tiny)),
    )


def middle_window(*analyses: Analysis) -> tuple[float, float]:
    """Return start and end [s] of `WINDOW_TURNS` shaft turns in the middle of the shortest record."""
    whole = min(one.processed.samples.size / one.processed.fs_hz for one in analyses)
    length = min(whole, WINDOW_TURNS / analyses[0].speed.value_hz)  # without the filter's ends
    return (whole - length) / 2, (whole + length) / 2


def record_views(analysis: Analysis, healthy: Analysis | None) -> tuple[RecordView, RecordView | None]:
    """Prepare a record (and a healthy one) for figures: same unit, time window, and frequencies of power spectra."""
    sides = [analysis] if healthy is None else [analysis, healthy]
    own_unit = analysis.recording.unit in OWN_UNITS and len({side.recording.unit for side in sides}) == 1
    window_s = middle_window(*sides)
    shown, *other = (record_view(side, window_s=window_s, own_unit=own_unit) for side in sides)
    if not other:
        return shown, None
    level = np.interp(shown.power_hz, other[0].power_hz, other[0].power_db, right=math.nan)
    return shown, dataclasses.replace(other[0], power_hz=shown.power_hz, power_db=level)


def load_signal(source: RecordSource) -> tuple[Recording, FloatArray]:
    """Return a recording and its signal to analyse, shape [n]; `source` is the recording, or its file or run."""
    recording = recording_of(source)
    return recording, one_signal(recording)


class Cursor(NamedTuple):
    """Named frequency [Hz] to mark in a spectrum; a sideband is drawn fainter than a harmonic."""

    name: str
    frequency_hz: float
    sideband: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class SpectrumView:
    """Envelope spectrum of `record` up to `end_hz`, drawn over the spectrum of `healthy` if given.

    `cursors` are the expected frequencies to mark, `peaks` the frequencies [Hz] and amplitudes of the detected lines.
    """

    record: RecordView
    healthy: RecordView | None
    cursors: tuple[Cursor, ...]
    peaks: tuple[tuple[float, float], ...]
    end_hz: float

    @property
    def records(self) -> tuple[RecordView, ...]:
        """The record and, if given, the healthy record."""
        return (self.record,) if self.healthy is None else (self.record, self.healthy)

    @property
    def highest(self) -> float:
        """Largest amplitude of the spectra."""
        return max(peak_amplitude(record, self.end_hz) for record in self.records)


def peak_amplitude(record: RecordView, end_hz: float) -> float:
    """Return the largest amplitude of the envelope spectrum up to `end_hz`, excluding slow trends near 0 Hz."""
    least_hz = min(MIN_SPECTRUM_HZ, MIN_SPECTRUM_ORDER * record.shaft_hz)
    return float(record.amplitude[(record.frequency_hz > least_hz) & (record.frequency_hz <= end_hz)].max())


def spectrum_end_hz(analysis: Analysis, marked: Line | None) -> float:
    """Choose the end of a plotted spectrum [Hz]: beyond four harmonics of `marked`, or if None beyond BPFO and BPFI."""
    end = MARKED_SPAN * marked.kinematic_hz if marked else RACES_SPAN * analysis.line_of(Fault.INNER).kinematic_hz
    low, high = analysis.processed.band_hz
    return min(end, high - low)


def spectrum_view(
    record: RecordView, healthy: RecordView | None = None, marked: Line | None = None, end_hz: float | None = None
) -> SpectrumView:
    """Prepare an envelope spectrum up to `end_hz` with the expected lines, and harmonics and sidebands of `marked`."""
    analysis = record.analysis
    end_hz = end_hz or spectrum_end_hz(analysis, marked)
    first = first_lines(analysis)
    found = [Cursor(line.name, line.kinematic_hz) for line in first if marked is None or line.name != marked.name]
    if marked is not None and Fault.of_line(marked.name) is not None:
        found += fault_cursors(record, marked, end_hz, 1)
    cursors = tuple(sorted((c for c in found if c.frequency_hz <= end_hz), key=lambda c: c.frequency_hz))
    return SpectrumView(record=record, healthy=healthy, cursors=cursors, peaks=detected_peaks(record), end_hz=end_hz)


def first_lines(analysis: Analysis) -> tuple[Line, ...]:
    """Return the first harmonic of every line of the bearing (BPFO, BPFI, 2xBSF, FTF), without sidebands."""
    return tuple(line for line in analysis.lines if line.is_first)


def marked_line(analysis: Analysis) -> Line | None:
    """Return the detected fault line with the greatest modulation depth, or None; figures mark its harmonics."""
    return next(iter(detected_fault_lines(analysis.lines)), None)


def detected_peaks(record: RecordView) -> tuple[tuple[float, float], ...]:
    """Return frequency [Hz] and amplitude of the peaks of all lines whose first harmonic was detected."""
    detected = tuple(line.name for line in first_lines(record.analysis) if line.detected)
    return tuple((hz, height) for name, hz, height in record.peaks if name.startswith(detected))


def fault_cursors(record: RecordView, line: Line, end_hz: float, pairs: int) -> tuple[Cursor, ...]:
    """List frequencies to mark up to `end_hz`: harmonics of a fault line, each with `pairs` pairs of sidebands."""
    fault, found = Fault.of_line(line.name), []
    spacing_hz = 0.0 if fault is None else fault.sideband_order(record.analysis.bearing.orders) * record.shaft_hz
    for harmonic in range(1, int(end_hz // line.kinematic_hz) + 1):
        for k in range(-pairs, pairs + 1) if spacing_hz else (0,):
            name, at = f"{harmonic}x{line.name}" if harmonic > 1 else line.name, harmonic * line.kinematic_hz
            if fault is not None and k:
                name += f"{'+' if k > 0 else '-'}{'' if abs(k) == 1 else abs(k)}{fault.sidebands}"
            if 0 < at + k * spacing_hz <= end_hz:
                found.append(Cursor(name, at + k * spacing_hz, sideband=k != 0))
    return tuple(sorted(found, key=lambda cursor: cursor.frequency_hz))


def power_share_near_line(image: Scalogram, line_hz: float) -> float:
    """Compute the share of a scalogram's power within 1/6 octave of a line; 0 if the line is outside the image."""
    power, frequency = (image.amplitude**2).mean(axis=1), image.frequency_hz
    near = (frequency >= line_hz / BAND_EDGE_FACTOR) & (frequency <= line_hz * BAND_EDGE_FACTOR)
    return float(power[near].sum() / power.sum())
