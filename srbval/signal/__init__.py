"""Signal processing: arrays in, arrays and frozen results out; knows nothing of files or bearings."""

from srbval.signal.bandpass import bandpass, check_band, drop_ends, end_s
from srbval.signal.comb import LineReading, read_comb
from srbval.signal.combine import normalise, rotate_axes
from srbval.signal.envelope import envelope, squared_envelope
from srbval.signal.kurtogram import Kurtogram, kurtogram
from srbval.signal.morlet import morlet_scalogram
from srbval.signal.one_pass import BandFilter, analytic_signal, envelope_spectrum_one_pass, squared_envelope_one_pass
from srbval.signal.order_tracking import ShaftCourse
from srbval.signal.periodogram import Periodogram
from srbval.signal.scalogram import Scalogram, scalogram
from srbval.signal.spectrum import Spectrum, amplitude_spectrum

__all__ = [
    "BandFilter",
    "Kurtogram",
    "LineReading",
    "Periodogram",
    "Scalogram",
    "ShaftCourse",
    "Spectrum",
    "amplitude_spectrum",
    "analytic_signal",
    "bandpass",
    "check_band",
    "drop_ends",
    "end_s",
    "envelope",
    "envelope_spectrum_one_pass",
    "kurtogram",
    "morlet_scalogram",
    "normalise",
    "read_comb",
    "rotate_axes",
    "scalogram",
    "squared_envelope",
    "squared_envelope_one_pass",
]
