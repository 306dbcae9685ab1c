"""Which bands of the shown records are impulsive, and what lines read in other bands than their own."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.errors import SrbvalError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.band_choice import band_kurtogram
from srbval.reading.lines import Line, line_entry
from srbval.recordings import Origin
from srbval.signal import Kurtogram


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordKurtogram:
    """A record's kurtogram; `line` is its state's.

    `second_comb` is the record in its most impulsive band, where the line stands there at another frequency than in the
    band used by more than both intervals allow; None elsewhere and for records that were not measured.
    """

    analysis: Analysis
    line: str
    kurtogram: Kurtogram
    second_comb: Analysis | None


def record_kurtogram(analysis: Analysis, line: str) -> RecordKurtogram:
    """Kurtogram of the signal that is analysed, and the comb of its most impulsive band."""
    picture = band_kurtogram(analysis.recording, analysis.bearing, analysis.speed)
    measured = analysis.recording.origin is Origin.MEASURED
    second = _second_comb(analysis, line, picture) if measured else None
    return RecordKurtogram(analysis=analysis, line=line, kurtogram=picture, second_comb=second)


def _second_comb(analysis: Analysis, line: str, picture: Kurtogram) -> Analysis | None:
    low, high = picture.best_hz
    margin = 0.01 * analysis.recording.fs_hz  # clear of zero and of half the sampling rate, where no filter reaches
    other = analyse(
        analysis.recording, bearing=analysis.bearing, speed=analysis.speed,
        band_hz=(max(low, margin), min(high, analysis.recording.fs_hz / 2 - margin)),
    )  # fmt: skip
    ours, theirs = analysis.line(line), other.line(line)
    if not (ours.detected and theirs.detected) or ours.found_hz is None or theirs.found_hz is None:
        return None
    apart = abs(ours.found_hz - theirs.found_hz)
    return other if apart > math.hypot(ours.ci95_hz or 0.0, theirs.ci95_hz or 0.0) else None


@dataclass(frozen=True, kw_only=True)
class CrossBand:
    """The line of a record's state in one band [Hz]; `own` marks the band in which all else of it is analysed.

    Where the record cannot be read in the band the line has no values, and `why` says so.
    """

    state: Fault
    origin: str
    file: str
    band_hz: tuple[float, float]
    own: bool
    line: Line
    why: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        return vars(self) | line_entry(self.line)


def cross_bands(model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis]) -> tuple[CrossBand, ...]:
    """Model and rig, outer and inner race, each in both sides' bands, its own band first.

    Both bands were fixed before these records were looked at, so neither costs a trial.
    """
    return tuple(
        _row(state, side, band_hz)
        for state in RACE_DEFECTS
        if state in model and state in rig
        for side, other in ((model[state], rig[state]), (rig[state], model[state]))
        for band_hz in dict.fromkeys((side.processed.band_hz, other.processed.band_hz))
    )


def _row(state: Fault, side: Analysis, band_hz: tuple[float, float]) -> CrossBand:
    line, why, own = side.line_of(state), "", band_hz == side.processed.band_hz
    if not own:
        try:
            line = analyse(side.recording, bearing=side.bearing, speed=side.speed, band_hz=band_hz).line_of(state)
        except SrbvalError as error:
            line, why = Line(name=line.name, harmonic=1, kinematic_hz=line.kinematic_hz), str(error)
    file = side.recording.file or side.recording.name
    return CrossBand(
        state=state, origin=side.recording.origin.value, file=file, band_hz=band_hz, own=own, line=line, why=why
    )
