"""What a picture of an analysis shows: which line is marked, up to where, and which lines are expected there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from srbval.bearing import Fault
from srbval.reading.lines import Line, detected_fault_lines
from srbval.reading.shown_record import ShownRecord, shown_record
from srbval.report.figures.record_figures import record_picture
from srbval.report.figures.spectrum import Cursor, fault_cursors

if TYPE_CHECKING:
    from srbval.reading.analyse import Analysis

WINDOW_TURNS = 3.0  # of the shaft, shown in time: a dozen blows or more of a race fault
HARMONICS_SHOWN, RACES_SHOWN = 4.4, 2.3  # of the marked line, or of the inner race's where none is: end of the spectra
OWN_UNIT, NORMALISED = "m/s²", "std. dev."
SIDEBANDS = 1  # drawn on either side of each harmonic of the marked line


def first_lines(analysis: Analysis) -> tuple[Line, ...]:
    """The first harmonic of every family, without sidebands."""
    return tuple(line for line in analysis.lines if line.is_first)


def marked_line(analysis: Analysis) -> Line | None:
    """The deepest fault line detected, whose harmonics a picture marks."""
    return next(iter(detected_fault_lines(analysis.lines)), None)


def spectrum_end_hz(analysis: Analysis, marked: Line | None) -> float:
    """Where the envelope spectrum of a picture ends [Hz]: a few harmonics of the marked line, within the band."""
    end = HARMONICS_SHOWN * marked.kinematic_hz if marked else RACES_SHOWN * analysis.line_of(Fault.INNER).kinematic_hz
    low, high = analysis.processed.band_hz
    return min(end, high - low)


def expected_lines(analysis: Analysis, marked: Line | None, end_hz: float) -> tuple[Cursor, ...]:
    """Harmonics of the marked line with their sidebands, and the first one of every other family, up to `end_hz`."""
    found = [Cursor(x.name, x.kinematic_hz) for x in first_lines(analysis) if marked is None or x.name != marked.name]
    fault = None if marked is None else Fault.of_line(marked.name)
    if marked is not None and fault is not None:
        spacing = fault.sideband_order(analysis.bearing.orders) * analysis.speed.value_hz
        found += fault_cursors(
            marked.name, marked.kinematic_hz, f_max_hz=end_hz, sideband_hz=spacing,
            sideband_name=fault.sidebands or "", sidebands=SIDEBANDS if spacing else 0,
        )  # fmt: skip
    return tuple(sorted((c for c in found if c.frequency_hz <= end_hz), key=lambda c: c.frequency_hz))


def own_peaks(shown: ShownRecord) -> tuple[tuple[float, float], ...]:
    """Frequency [Hz] and height of the detected peaks, of those lines alone whose first harmonic was detected."""
    own = tuple(line.name for line in first_lines(shown.analysis) if line.detected)
    return tuple((hz, height) for name, hz, height in shown.peaks if name.startswith(own))


def middle_window(analyses: Sequence[Analysis]) -> tuple[float, float]:
    """The middle of the shortest record, `WINDOW_TURNS` long or as long as it is [s], its filter's ends dropped."""
    whole = min(one.processed.samples.size / one.processed.fs_hz for one in analyses)
    length = min(whole, WINDOW_TURNS / analyses[0].speed.value_hz)
    return (whole - length) / 2, (whole + length) / 2


def in_own_unit(analyses: Sequence[Analysis]) -> bool:
    """Whether all are in m/s2, so that they may be drawn in it; else they are in standard deviations of themselves."""
    return all(one.recording.unit == "m/s2" for one in analyses)


def analysis_picture(analysis: Analysis, healthy: Analysis | None = None) -> Any:
    """A matplotlib figure: the middle of the record with its envelope, and the envelope spectrum with its lines.

    `healthy`, analysed in the same band, is drawn dashed. In the recording's unit where that is m/s2 (of both), else
    in standard deviations.
    """
    marked, sides = marked_line(analysis), [analysis] if healthy is None else [analysis, healthy]
    own_unit, window_s = in_own_unit(sides), middle_window(sides)
    shown, *other = (shown_record(side, window_s=window_s, own_unit=own_unit) for side in sides)
    end_hz = spectrum_end_hz(analysis, marked)
    return record_picture(
        time=(shown.time_s - window_s[0], shown.acceleration, shown.envelope),
        spectrum=(shown.frequency_hz, shown.amplitude),
        healthy=(other[0].frequency_hz, other[0].amplitude) if other else None,
        cursors=expected_lines(analysis, marked, end_hz),
        peaks=own_peaks(shown),
        shaft_hz=analysis.speed.value_hz,
        f_max_hz=end_hz,
        origin=analysis.recording.origin.value,
        title=f"{analysis.recording.name}, {60 * analysis.speed.value_hz:.5g} rpm",
        unit=OWN_UNIT if own_unit else NORMALISED,
    )
