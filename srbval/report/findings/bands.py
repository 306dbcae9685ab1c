"""Which bands of the shown records are impulsive, and what the most impulsive one reads."""

import math
from dataclasses import dataclass

from srbval.reading.analyse import Analysis, analyse
from srbval.reading.band_choice import band_kurtogram
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
