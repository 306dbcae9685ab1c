"""What Figures 11 to 14 show of each record: signal and envelope, spectra and scalogram, ready to be drawn."""

from dataclasses import dataclass

from srbval.reading.analyse import Analysis
from srbval.reading.shown_record import ShownRecord
from srbval.signal import Scalogram, morlet_scalogram
from srbval.signal.scalogram import COLUMNS, ROWS

SCALOGRAM_HZ = (40.0, 1000.0)  # shown in Figure 14
# What draws it, of the transforms that `studies/reading_accuracy/scalogram_check.py` tries; the largest error allowed.
SCALOGRAM_TRANSFORM, SCALOGRAM_ERROR = "pywt.cwt, symmetric wavelets", 0.005


@dataclass(frozen=True, kw_only=True)
class SidebandShares:
    """Sidebands of the inner-race line at one and two shaft speeds, mean of both sides, as shares of the line."""

    at_one: float
    at_two: float


def envelope_scalogram(shown: ShownRecord) -> Scalogram:
    """The wavelet transform of the envelope shown."""
    envelope, fs_hz = shown.envelope - shown.envelope.mean(), shown.analysis.processed.fs_hz
    return morlet_scalogram(envelope, fs_hz, range_hz=SCALOGRAM_HZ, rows=ROWS, columns=COLUMNS)


def sideband_shares(analysis: Analysis) -> SidebandShares | None:
    """None where the inner-race line was not read."""
    line_hz, shaft_hz = analysis.line("BPFI").found_hz, analysis.speed.value_hz
    if line_hz is None:
        return None
    spectrum = analysis.processed.spectrum
    line, *sides = (spectrum.height_at(line_hz + times * shaft_hz) for times in (0, -1, 1, -2, 2))
    return SidebandShares(at_one=(sides[0] + sides[1]) / 2 / line, at_two=(sides[2] + sides[3]) / 2 / line)
