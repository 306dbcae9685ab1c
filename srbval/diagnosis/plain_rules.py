"""Simple rules that name a fault: common practice with an envelope spectrum, and the greatest excess of a comb."""

import itertools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.reading.pipeline import WHOLE_BAND, band_kurtogram, declared_band, one_signal
from srbval.recordings import Recording
from srbval.signal import amplitude_spectrum, drop_ends, end_s, normalise, prewhitened, squared_envelope_one_pass

THRESHOLD = 5.0  # a line counts from this many times the median amplitude of its neighbourhood
WINDOW, NEIGHBOURHOOD = 0.02, 0.2  # half widths of a line's window and of its neighbourhood, as shares of its frequency
BANDS, LEAST_EXCESS, LEAST_MARGIN = 8, 8.0, 3.0


def common_practice(recording: Recording, bearing: Bearing) -> dict[str, Fault | None]:
    """Fault that each rule of common practice calls: the highest line in an envelope spectrum, above a threshold.

    The rules demodulate in the data set's band, in the most impulsive band of the record, in the best of eight bands,
    or in the whole band after cepstrum prewhitening.
    """
    speed, signal, fs_hz = recording.speed, normalise(one_signal(recording)), recording.fs_hz
    assert speed is not None, "every data set states a speed"
    low, high = (share * fs_hz for share in WHOLE_BAND)
    signals = {
        "fixed band": (signal, [declared_band(recording, None).band_hz]),
        "kurtogram": (signal, [band_kurtogram(recording, bearing, speed).best_hz]),
        "best of 8 bands": (signal, itertools.pairwise(np.linspace(low, high, BANDS + 1).tolist())),
        "prewhitening": (prewhitened(signal), [(low, high)]),
    }
    lines_hz: dict[Fault, float] = {fault: fault.line_order(bearing.orders) * speed.value_hz for fault in DEFECTS}
    return {name: strongest_line(samples, fs_hz, bands, lines_hz) for name, (samples, bands) in signals.items()}


def strongest_line(
    samples: FloatArray, fs_hz: float, bands_hz: Iterable[tuple[float, float]], lines_hz: Mapping[Fault, float]
) -> Fault | None:
    """The fault whose first harmonic is highest over its neighbourhood's median; None if none reaches `THRESHOLD`.

    Amplitudes are those of the squared envelope of `samples` [n] in each of `bands_hz`, within `WINDOW` of the line.
    """
    ratios = dict.fromkeys(lines_hz, 0.0)
    for band_hz in bands_hz:
        square, rate = squared_envelope_one_pass(samples, fs_hz, band_hz)
        spectrum = amplitude_spectrum(drop_ends(square, rate, end_s(band_hz)), rate)
        for fault, line_hz in lines_hz.items():
            off = np.abs(spectrum.frequency_hz / line_hz - 1)
            inside, about = spectrum.amplitude[off <= WINDOW], (off > WINDOW) & (off <= NEIGHBOURHOOD)
            ratio = inside.max(initial=0.0) / np.median(spectrum.amplitude[about]) if about.any() else 0.0
            ratios[fault] = max(float(ratio), ratios[fault])
    best = max(ratios, key=lambda fault: ratios[fault])
    return best if ratios[best] >= THRESHOLD else None


def by_excess(views: Sequence[Sequence[float]]) -> Fault | None:
    """The fault of the greatest excess in any of `views`, if it is great and far above the others of that view."""
    best = max(views, key=max)
    *_, second, first = sorted(best)
    clear = first >= LEAST_EXCESS and first - max(0.0, second) >= LEAST_MARGIN
    return DEFECTS[list(best).index(first)] if clear else None
