import numpy as np
import pytest

from srbval.signal import amplitude_spectrum, envelope, squared_envelope

FS_HZ = 8192.0
SAMPLES = 16384
CARRIER_HZ, MODULATION_HZ = 1500.0, 60.0
# All tones lie on bins, so only rounding is left.
ROUNDING = 1e-9


def modulated(amplitude, depth):
    time_s = np.arange(SAMPLES) / FS_HZ
    return (
        amplitude
        * (1 + depth * np.cos(2 * np.pi * MODULATION_HZ * time_s + 0.3))
        * np.cos(2 * np.pi * CARRIER_HZ * time_s)
    )


def line(spectrum, frequency_hz):
    return spectrum.amplitude[np.argmin(np.abs(spectrum.frequency_hz - frequency_hz))]


@pytest.mark.parametrize(("amplitude", "depth"), [(1.0, 0.5), (3.0, 0.2)])
def test_envelope_of_a_modulated_carrier_has_a_line_of_amplitude_times_depth(amplitude, depth):
    spectrum = amplitude_spectrum(envelope(modulated(amplitude, depth)), FS_HZ)
    assert line(spectrum, MODULATION_HZ) == pytest.approx(amplitude * depth, abs=ROUNDING)


@pytest.mark.parametrize(("amplitude", "depth"), [(1.0, 0.5), (3.0, 0.2)])
def test_squared_envelope_has_lines_at_once_and_twice_the_modulation(amplitude, depth):
    spectrum = amplitude_spectrum(squared_envelope(modulated(amplitude, depth)), FS_HZ)
    assert line(spectrum, MODULATION_HZ) == pytest.approx(2 * amplitude**2 * depth, abs=ROUNDING)
    assert line(spectrum, 2 * MODULATION_HZ) == pytest.approx(amplitude**2 * depth**2 / 2, abs=ROUNDING)
