"""Amplitudes of a record: levels in third octaves from 400 to 3150 Hz, and harmonics and sidebands of a line."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft  # scipy.signal takes half a second: scipy loads it at its first use

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.butterworth import FILTER_ORDER
from srbval.path.locked import locked_powers
from srbval.reading.pipeline import choose_tracking, one_signal, process
from srbval.recordings import Origin, Recording
from srbval.scene import BANDS_HZ
from srbval.scene.sensor_path import HALF_THIRD_OCTAVE
from srbval.signal import LEAST_SNR, NORMAL_95, drop_ends, end_s, kurtosis, power_density

if TYPE_CHECKING:
    from pandas import DataFrame

ENVELOPE_HZ, WHOLE_HZ = BANDS_HZ["1400-2800"], (400.0, 3150.0)
RMS_BANDS = {f"RMS {name} Hz": band for name, band in (BANDS_HZ | {"400-3150": WHOLE_HZ}).items()}
KURTOSIS_BANDS = {"kurtosis 1400-2800 Hz": ENVELOPE_HZ, "kurtosis 400-3150 Hz": WHOLE_HZ}
SEGMENT_S, KURTOSIS_BLOCKS = 0.25, 8
SCATTERS_DB = np.linspace(0.02, 12.0, 600)  # between mountings, tried
PATTERN_HARMONICS, SIDEBAND_SPACINGS = range(2, 7), (1, 2)
PEAK_REACH_BINS, NOISE_REACH_BINS = 1.5, 40
DB_OF_SHARE = 10 / math.log(10)  # a small relative change of a power, in dB
TINY = 1e-30  # power [(m/s2)^2] below which a level stops: a run without noise repeats exactly


def third_octaves(band_hz: tuple[float, float]) -> dict[float, tuple[float, float]]:
    """Edges [Hz], by exact centre frequency [Hz], of the third octaves (base ten) with the centre in a band."""
    first, last = (10 * math.log10(one) for one in band_hz)
    middles = [10 ** (n / 10) for n in range(math.ceil(first - 0.05), math.floor(last + 0.05) + 1)]
    return {hz: (hz / HALF_THIRD_OCTAVE, hz * HALF_THIRD_OCTAVE) for hz in middles}


LEVEL_BANDS = {f"{hz:.0f} Hz": edges for hz, edges in third_octaves(WHOLE_HZ).items()}


@dataclass(frozen=True, kw_only=True)
class Amplitude:
    """Quantity of a record, such as a level or kurtosis, with the half width `ci95` of its 95 % interval.

    `present` is false if noise may explain the value; `least` is the smallest value that noise does not explain.
    """

    value: float
    ci95: float = 0.0
    present: bool = True
    least: float = -math.inf


Amplitudes = dict[str, Amplitude]  # by the name of the quantity


def decibels(power: float) -> float:
    """Level of a power [dB]; a power of zero or less, which an estimate may have, gives a very low but finite level."""
    return DB_OF_SHARE * math.log(max(power, TINY))


def band_powers(recording: Recording, bands_hz: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Power in each band [(m/s2)^2] by Welch's method.

    Samples of a simulated record are means over the sampling interval; the loss of power by averaging is compensated.
    """
    at_hz, density = power_density(one_signal(recording), recording.fs_hz, SEGMENT_S)
    if recording.origin is Origin.SIMULATED:
        density = density / np.sinc(at_hz / recording.fs_hz) ** 2
    places = {name: [low, *at_hz[(at_hz > low) & (at_hz < high)], high] for name, (low, high) in bands_hz.items()}
    return {name: float(np.trapezoid(np.interp(hz, at_hz, density), hz)) for name, hz in places.items()}


def levels(recording: Recording, healthy: Recording | None) -> Amplitudes:
    """Level [dB re 1 m/s2] in third octaves and wider bands, after the power of a `healthy` record is subtracted."""
    bands, found = LEVEL_BANDS | RMS_BANDS, {}
    own, floor = (band_powers(one, bands) if one else dict.fromkeys(bands, 0.0) for one in (recording, healthy))
    for name, (low, high) in bands.items():
        u = math.hypot(own[name], floor[name]) / math.sqrt((high - low) * recording.seconds)
        increment = max(own[name] - floor[name], 0.1 * u)
        ci95 = NORMAL_95 * DB_OF_SHARE * min(u / increment, 1.0)
        found[name] = Amplitude(value=decibels(increment), ci95=ci95, present=own[name] - floor[name] > 2 * u)
    return found


def totals(recording: Recording, added: Recording | None = None) -> Amplitudes:
    """Level [dB re 1 m/s2] of the power in each third octave after the power of `added`, if given, is added."""
    found = {}
    powers, more = band_powers(recording, LEVEL_BANDS), band_powers(added, LEVEL_BANDS) if added else {}
    for name, (low, high) in LEVEL_BANDS.items():
        ci95 = NORMAL_95 * DB_OF_SHARE / math.sqrt((high - low) * recording.seconds)
        found[f"total {name}"] = Amplitude(value=decibels(powers[name] + more.get(name, 0.0)), ci95=ci95)
    return found


def locked_levels(recording: Recording, bearing: Bearing, line_order: float) -> Amplitudes:
    """Level of the power that repeats at shaft order `line_order`, in each third octave [dB re 1 m/s2]."""
    found = {}
    for name, power in locked_powers(recording, bearing, line_order, LEVEL_BANDS).items():
        value = max(power.value, power.ci95 / 2)
        found[f"locked {name}"] = Amplitude(
            value=decibels(value),
            ci95=DB_OF_SHARE * min(power.ci95 / max(value, TINY), 1.0),
            present=power.value > power.ci95,
            least=decibels(power.ci95),
        )
    return found


def pattern(
    recording: Recording, bearing: Bearing, fault: Fault, line_order: float, band_hz: tuple[float, float] = ENVELOPE_HZ
) -> Amplitudes:
    """Harmonics and sidebands of a fault line relative to its first harmonic [dB], modulation depth [%], and kurtosis.

    Lines and depth are read in the squared envelope of a band; `line_order` is the line's frequency over shaft speed.
    """
    speed = recording.known_speed
    processed = process(recording, band_hz=band_hz, tracking=choose_tracking(recording, bearing, speed))
    square, rate, line_hz = processed.squared, processed.squared_fs_hz, line_order * speed.value_hz
    spacing_hz = fault.sideband_order(bearing.orders) * speed.value_hz
    first, first_snr = _line_power(square, rate, line_hz)
    places: dict[str, tuple[float, ...]] = {f"harmonic {h}": (h * line_hz,) for h in PATTERN_HARMONICS}
    if spacing_hz:
        places |= {f"sidebands {n}": (line_hz - n * spacing_hz, line_hz + n * spacing_hz) for n in SIDEBAND_SPACINGS}
    found = {}
    for name, at in places.items():
        read = [_line_power(square, rate, one) for one in at]
        power = float(np.mean([p for p, _ in read]))
        spread = math.hypot(1 / math.sqrt(2 * first_snr), *(1 / math.sqrt(2 * s) / len(at) for _, s in read))
        found[name] = Amplitude(
            value=DB_OF_SHARE * math.log(power / first),
            ci95=NORMAL_95 * 2 * DB_OF_SHARE * spread,
            present=min(first_snr, *(snr for _, snr in read)) > LEAST_SNR,
        )
    depth = 200 * math.sqrt(first) / float(square.mean())
    ci95 = NORMAL_95 * depth / math.sqrt(2 * first_snr)
    return found | {"depth": Amplitude(value=depth, ci95=ci95, present=first_snr > LEAST_SNR)} | kurtoses(recording)


def kurtoses(recording: Recording) -> Amplitudes:
    """Kurtosis of a record in each of `KURTOSIS_BANDS`; intervals by the jackknife over blocks (Efron & Stein 1981)."""
    found = {}
    for name, band in KURTOSIS_BANDS.items():
        sections = scipy.signal.butter(FILTER_ORDER, band, "bandpass", fs=recording.fs_hz, output="sos")
        passed = drop_ends(scipy.signal.sosfiltfilt(sections, one_signal(recording)), recording.fs_hz, end_s(WHOLE_HZ))
        parts = np.array_split(passed, KURTOSIS_BLOCKS)
        without = np.array([kurtosis(np.concatenate([*parts[:i], *parts[i + 1 :]])) for i in range(KURTOSIS_BLOCKS)])
        u = math.sqrt((KURTOSIS_BLOCKS - 1) * float(np.mean((without - without.mean()) ** 2)))
        found[name] = Amplitude(value=kurtosis(passed), ci95=NORMAL_95 * u)
    return found


def level_and_pattern(errors_db: FloatArray, covariance: FloatArray) -> tuple[float, float, float]:
    """Split level errors of n bands into their weighted mean [dB], its standard deviation, and the misfit D^2.

    Generalised least squares (Aitken 1935, Proc. R. Soc. Edinb. 55, 42); theory: "Level and pattern of a record". If
    the `covariance` of the errors is right, D^2 is chi-squared with n - 1 degrees of freedom.
    """
    weights = np.linalg.solve(covariance, np.ones(errors_db.size))
    u = 1 / math.sqrt(float(weights.sum()))
    level = float(weights @ errors_db) * u**2
    return level, u, max(float(errors_db @ np.linalg.solve(covariance, errors_db)) - (level / u) ** 2, 0.0)


def separate_levels(rows: "DataFrame", parts: Sequence[str], drawn: "DataFrame") -> "DataFrame":
    """Split each record's errors in its frequency bands into a ``level`` common to all bands [dB] and a pattern.

    `rows` has an ``error`` [dB] for each ``record``, ``used_for`` and ``quantity`` (band), and in the columns `parts`
    the half widths of independent uncertainties. `drawn` has a column for each record and band, with a level simulated
    with random inputs in each row, for the covariance of the errors. ``level_p`` and ``pattern_p`` are the
    probabilities of larger values by chance (Student's t, chi-squared). With few rows of `drawn` the latter is too
    small.
    """
    from pandas import DataFrame
    from scipy.special import chdtrc, stdtr

    tests = []
    for (record, used_for), of in rows.groupby(["record", "used_for"], sort=False):
        if (bands := len(of)) > 1:
            own_u = np.sqrt((of[list(parts)] ** 2).sum(axis=1)).to_numpy() / NORMAL_95
            covariance = np.cov(drawn[list(of.record + " " + of.quantity)].to_numpy(float), rowvar=False)
            level, u, d2 = level_and_pattern(of.error.to_numpy(), covariance + np.diag(own_u**2))
            found = {"record": record, "used_for": used_for, "bands": bands, "level": level, "u": u, "d2": d2}
            chances = {"level_p": 2 * stdtr(len(drawn) - 1, -abs(level / u)), "pattern_p": chdtrc(bands - 1, d2)}
            tests.append(found | chances)
    return DataFrame(tests)


def mounting_scatter(pairs: Iterable[tuple[Recording, Recording]], prior_db: float) -> dict[str, float]:
    """Standard deviation [dB] of a record's level over repeated mountings of a bearing: posterior mean, 95 % interval.

    Each of `pairs` is a record of a faulty bearing and a record of a healthy bearing in another mounting. A fault adds
    power, so only third octaves in which the faulty record is quieter are used: there the mounting must have changed
    the level. The prior is half-normal with scale `prior_db`. Theory: "Level and pattern of a record".
    """
    off, u = [], []
    for faulty, healthy in pairs:
        powers = [band_powers(one, LEVEL_BANDS) for one in (faulty, healthy)]
        off += [decibels(powers[0][name]) - decibels(powers[1][name]) for name in LEVEL_BANDS]
        u += [DB_OF_SHARE * math.sqrt(2 / ((high - low) * faulty.seconds)) for low, high in LEVEL_BANDS.values()]
    quieter = np.array([(db, own) for db, own in zip(off, u, strict=True) if db < 0]).reshape(-1, 2)
    variance = 2 * SCATTERS_DB[:, None] ** 2 + quieter[:, 1] ** 2
    likelihood = -(np.log(variance) + quieter[:, 0] ** 2 / variance).sum(axis=1) / 2
    logarithm = likelihood - SCATTERS_DB**2 / (2 * prior_db**2)
    weight = np.exp(logarithm - logarithm.max())
    low, high = np.interp((0.025, 0.975), np.cumsum(weight) / weight.sum(), SCATTERS_DB)
    found = {"scatter_db": float(weight @ SCATTERS_DB / weight.sum()), "low_db": float(low), "high_db": float(high)}
    return found | {"quieter": len(quieter), "bands": len(off)}


def _line_power(square: FloatArray, rate: float, line_hz: float) -> tuple[float, float]:
    """Power of the highest peak within `PEAK_REACH_BINS` of `line_hz` in a spectrum, and its ratio to the local noise.

    The spectrum is that of `square`, a squared envelope with `rate` samples per second.
    """
    length = 8 * square.size
    power = np.abs(scipy.fft.rfft(square - square.mean(), n=length)) ** 2 / square.size**2
    place, wide, reach = line_hz / (rate / length), 8 * PEAK_REACH_BINS, 8 * NOISE_REACH_BINS
    near = power[max(round(place - wide), 0) : round(place + wide) + 1]
    around = power[max(round(place - reach), 16) : round(place + reach) : 8]
    noise = float(np.median(around)) / math.log(2)
    peak = float(near.max())
    return peak, max(peak / noise, 0.5)
