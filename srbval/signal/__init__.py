"""Signal processing: arrays as input, arrays or frozen results as output, without files or bearings."""

from srbval.signal.comb import LEAST_SNR, LineReading, is_improbable, peak_snr, read_comb
from srbval.signal.envelope import analytic_signal, drop_ends, end_s, normalise, rotate_axes, squared_envelope_one_pass
from srbval.signal.order_tracking import ShaftAngle
from srbval.signal.periodogram import Periodogram, Phasors
from srbval.signal.slip import NORMAL_95, frequency_error_hz
from srbval.signal.spectrum import (
    Kurtogram,
    Scalogram,
    Spectrum,
    amplitude_spectrum,
    envelope_spectrum,
    kurtogram,
    kurtosis,
    morlet_scalogram,
    power_density,
    prewhitened,
)
