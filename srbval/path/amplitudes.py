"""Amplitudes in m/s2 and patterns of a record.

Levels are those of the fault's increment: a record's power in a band less that of the healthy record of the same speed.
Third octaves are those of IEC 61260-1, 400 to 3150 Hz; outside, the rig's records hold tones of its drive that do not
move with the speed. Lines are read from the squared envelope in `ENVELOPE_HZ`, the paper's band for the rig.
"""

import math

import numpy as np
import scipy.fft
import scipy.signal

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import QuantityValue
from srbval.errors import DataError
from srbval.models.sensor import ORDER
from srbval.reading.locked import locked_powers
from srbval.reading.pipeline import choose_tracking, one_signal, process
from srbval.recordings import Origin, Recording
from srbval.scene import BANDS_HZ
from srbval.signal import LEAST_SNR, NORMAL_95, drop_ends, end_s, kurtosis, power_density

ENVELOPE_HZ, WHOLE_HZ = BANDS_HZ["1400-2800"], (400.0, 3150.0)
THIRD_OCTAVES = {f"{10 ** (n / 10):.0f} Hz": 10 ** (n / 10) for n in range(26, 36)}  # base ten, exact middles
LEVEL_BANDS = {name: (middle * 10**-0.05, middle * 10**0.05) for name, middle in THIRD_OCTAVES.items()}
RMS_BANDS = {f"RMS {name} Hz": band for name, band in (BANDS_HZ | {"400-3150": WHOLE_HZ}).items()}
KURTOSIS_BANDS = {"kurtosis 1400-2800 Hz": ENVELOPE_HZ, "kurtosis 400-3150 Hz": WHOLE_HZ}
MARGIN = {"dB": VERDICT.level_db, "%": VERDICT.share_pct}
SEGMENT_S, BLOCKS = 0.25, 8
HARMONICS, SIDEBANDS = range(2, 7), (1, 2)
NEAR_BINS, NOISE_BINS = 1.5, 40
DB = 10 / math.log(10)


def record_density(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and power density [(m/s2)^2/Hz] by Welch's method in segments of `SEGMENT_S`.

    A run's samples are means over output intervals: what that takes from its density is given back.
    """
    fs_hz = recording.fs_hz
    own_hz, density = power_density(one_signal(recording), fs_hz, SEGMENT_S)
    return own_hz, density / np.sinc(own_hz / fs_hz) ** 2 if recording.origin is Origin.SIMULATED else density


def band_power(recording: Recording, band_hz: tuple[float, float]) -> float:
    """Power in a band [(m/s2)^2]."""
    own_hz, density = record_density(recording)
    inside = own_hz[(own_hz > band_hz[0]) & (own_hz < band_hz[1])]
    at = np.array([band_hz[0], *inside, band_hz[1]])
    return float(np.trapezoid(np.interp(at, own_hz, density), at))


def levels(
    recording: Recording, healthy: Recording | None, mounting_db: float = 0.0
) -> dict[str, QuantityValue]:  # fmt: skip
    """Levels of the increment over `healthy` in all bands [dB re 1 m/s2]; of the record itself without one.

    Of the increment D - H the variance is (D^2 + H^2) / (B T) and, where the levels of either mounting scatter by
    `mounting_db`, 2 (H s)^2 with that as a share of the power, s. One below two deviations is not resolved.
    """
    found = {}
    for name, band in (LEVEL_BANDS | RMS_BANDS).items():
        own = band_power(recording, band)
        floor = 0.0 if healthy is None else band_power(healthy, band)
        noise = math.hypot(own, floor) / math.sqrt((band[1] - band[0]) * recording.seconds)
        u = math.hypot(noise, math.sqrt(2) * floor * mounting_db / DB)
        increment = max(own - floor, 0.1 * u)
        found[name] = QuantityValue(
            value=DB * math.log(increment), ci95=NORMAL_95 * DB * min(u / increment, 1.0), present=own - floor > 2 * u
        )
    return found


def locked_levels(recording: Recording, bearing: Bearing, line_order: float) -> dict[str, QuantityValue]:
    """Power locked to the fault per third octave [dB re 1 m/s2], see `srbval.reading.locked`.

    `least` is the level from which on it would be shown; of one that is not, the value is half of that power at least.
    `halves` are the levels of both halves of the record, NaN for one that noise makes negative.
    """
    found = {}
    for name, power in locked_powers(recording, bearing, line_order, LEVEL_BANDS).items():
        value, tiny = max(power.value, power.ci95 / 2), 1e-30  # a run without noise repeats exactly
        found[f"locked {name}"] = QuantityValue(
            value=DB * math.log(max(value, tiny)), ci95=DB * min(power.ci95 / max(value, tiny), 1.0),
            present=power.value > power.ci95, least=DB * math.log(max(power.ci95, tiny)),
            halves=np.array([DB * math.log(one) if one > 0 else math.nan for one in power.halves]),
        )  # fmt: skip
    return found


def pattern(
    recording: Recording, bearing: Bearing, fault: Fault, line_order: float,
    band_hz: tuple[float, float] = ENVELOPE_HZ,
) -> dict[str, QuantityValue]:  # fmt: skip
    """Harmonics and sidebands over the first harmonic [dB], depth of modulation [%], kurtosis in two bands.

    `line_order` is that of the fault's line as it was found; its squared envelope is followed over the shaft's angle.
    """
    speed = recording.speed
    if speed is None:
        raise DataError(f"{recording.name}: no shaft speed; patterns are read at multiples of it. Give --rpm.")
    processed = process(recording, band_hz=band_hz, tracking=choose_tracking(recording, bearing, speed))
    square, rate, line_hz = processed.squared, processed.squared_fs_hz, line_order * speed.value_hz
    spacing_hz = fault.sideband_order(bearing.orders) * speed.value_hz
    first, first_snr = _line(square, rate, line_hz)
    places: dict[str, tuple[float, ...]] = {f"harmonic {h}": (h * line_hz,) for h in HARMONICS}
    if spacing_hz:
        places |= {f"sidebands {n}": (line_hz - n * spacing_hz, line_hz + n * spacing_hz) for n in SIDEBANDS}
    found = {}
    for name, at in places.items():
        read = [_line(square, rate, one) for one in at]
        power = float(np.mean([p for p, _ in read]))
        spread = math.hypot(1 / math.sqrt(2 * first_snr), *(1 / math.sqrt(2 * s) / len(at) for _, s in read))
        found[name] = QuantityValue(
            value=DB * math.log(power / first), ci95=NORMAL_95 * 2 * DB * spread,
            present=min(first_snr, *(snr for _, snr in read)) > LEAST_SNR,
        )  # fmt: skip
    depth = 200 * math.sqrt(first) / float(square.mean())
    found["depth"] = QuantityValue(
        value=depth, ci95=NORMAL_95 * depth / math.sqrt(2 * first_snr), present=first_snr > LEAST_SNR
    )
    return found | kurtoses(recording)


def kurtoses(recording: Recording) -> dict[str, QuantityValue]:
    """Kurtosis in both bands; intervals from leaving out one block after the other (jackknife: Efron & Stein 1981)."""
    found = {}
    for name, band in KURTOSIS_BANDS.items():
        sections = scipy.signal.butter(ORDER, band, "bandpass", fs=recording.fs_hz, output="sos")
        passed = drop_ends(scipy.signal.sosfiltfilt(sections, one_signal(recording)), recording.fs_hz, end_s(WHOLE_HZ))
        parts = np.array_split(passed, BLOCKS)
        without = np.array([kurtosis(np.concatenate([*parts[:i], *parts[i + 1 :]])) for i in range(BLOCKS)])
        u = math.sqrt((BLOCKS - 1) * float(np.mean((without - without.mean()) ** 2)))
        found[name] = QuantityValue(value=kurtosis(passed), ci95=NORMAL_95 * u)
    return found


def _line(square: FloatArray, rate: float, line_hz: float) -> tuple[float, float]:
    """Power of a line within `NEAR_BINS`, and that over the local noise."""
    length = 8 * square.size
    power = np.abs(scipy.fft.rfft(square - square.mean(), n=length)) ** 2 / square.size**2
    step = rate / length
    near = power[max(round(line_hz / step - 8 * NEAR_BINS), 0) : round(line_hz / step + 8 * NEAR_BINS) + 1]
    around = power[max(round(line_hz / step - 8 * NOISE_BINS), 16) : round(line_hz / step + 8 * NOISE_BINS) : 8]
    noise = float(np.median(around)) / math.log(2)
    peak = float(near.max())
    return peak, max(peak / noise, 0.5)
