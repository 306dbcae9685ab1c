"""Signal processing: arrays in, arrays and frozen results out; knows nothing of files or bearings.

Other rooms import the names below from here, anything else from its module.
"""

from srbval.signal.bandpass import bandpass, check_band, drop_ends, end_s
from srbval.signal.comb import LEAST_SNR, LineReading, is_improbable, peak_snr, read_comb
from srbval.signal.combine import normalise, rotate_axes
from srbval.signal.envelope import (
    BandFilter,
    analytic_signal,
    butterworth_gain,
    envelope,
    envelope_spectrum,
    envelope_spectrum_one_pass,
    squared_envelope,
    squared_envelope_one_pass,
)
from srbval.signal.interval import NORMAL_95, frequency_error_hz
from srbval.signal.kurtogram import Kurtogram, kurtogram
from srbval.signal.order_tracking import ShaftAngle
from srbval.signal.periodogram import Periodogram
from srbval.signal.phasors import Phasors
from srbval.signal.scalogram import Scalogram, check_range, column_width, morlet_scalogram
from srbval.signal.spectrum import Spectrum, amplitude_spectrum

__all__ = [
    "LEAST_SNR", "NORMAL_95", "BandFilter", "Kurtogram", "LineReading", "Periodogram", "Phasors", "Scalogram",
    "ShaftAngle", "Spectrum", "amplitude_spectrum", "analytic_signal", "bandpass", "butterworth_gain", "check_band",
    "check_range", "column_width", "drop_ends", "end_s", "envelope", "envelope_spectrum",
    "envelope_spectrum_one_pass",
    "frequency_error_hz", "is_improbable", "kurtogram", "morlet_scalogram", "normalise", "peak_snr", "read_comb",
    "rotate_axes", "squared_envelope", "squared_envelope_one_pass",
]  # fmt: skip
