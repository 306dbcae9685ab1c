"""Fault naming as it is commonly done: the highest of the fault lines in an envelope spectrum, above a threshold.

Two baselines for every other way of naming. Nothing in them was fitted to a record.
"""

import numpy as np

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.reading.pipeline import one_signal
from srbval.recordings import Recording, ShaftSpeed
from srbval.signal import amplitude_spectrum, drop_ends, end_s, normalise, squared_envelope_one_pass

# A line counts from this many times the median amplitude of its neighbourhood.
THRESHOLD = 5.0
# Half widths of a line's window and of its neighbourhood, as shares of its frequency.
WINDOW, NEIGHBOURHOOD = 0.02, 0.2


def strongest_line(
    recording: Recording, bearing: Bearing, speed: ShaftSpeed, band_hz: tuple[float, float]
) -> Fault | None:
    """The fault whose line stands highest over its neighbourhood's median; None where none reaches `THRESHOLD`.

    Amplitudes of the squared envelope in `band_hz` [Hz]; first harmonics, within `WINDOW` of kinematics at `speed`.
    """
    square, rate = squared_envelope_one_pass(normalise(one_signal(recording)), recording.fs_hz, band_hz)
    spectrum = amplitude_spectrum(drop_ends(square, rate, end_s(band_hz)), rate)
    ratios = {}
    for fault in DEFECTS:
        kinematic_hz = fault.line_order(bearing.orders) * speed.value_hz
        off = np.abs(spectrum.frequency_hz / kinematic_hz - 1)
        inside, about = off <= WINDOW, (off > WINDOW) & (off <= NEIGHBOURHOOD)
        if inside.any() and about.any():
            ratios[fault] = float(spectrum.amplitude[inside].max() / np.median(spectrum.amplitude[about]))
    best = max(ratios, key=lambda fault: ratios[fault], default=None)
    return best if best is not None and ratios[best] >= THRESHOLD else None
