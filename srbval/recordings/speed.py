"""Shaft speed from a tachometer signal, from a stated value or from a set point."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.recording import ShaftSpeed, SpeedSignal, SpeedSource

RPM_PER_HZ = 60.0
Z95 = 1.96
MIN_TACHOMETER_SAMPLES = 8
MAX_BLOCKS = 8192
PROFILE_STEP_S = 1e-3
LIMIT_HZ = 2000.0  # above the speed of any rolling bearing


def tachometer_speed(speed_hz: FloatArray) -> ShaftSpeed:
    """Mean of a tachometer signal [Hz], evenly sampled, with its 95 % interval and drift.

    The interval is 1.96 standard errors, the samples' correlation counted by their integrated
    autocorrelation time (Priestley, Spectral Analysis and Time Series, 1981, sect. 5.3.2): a smoothed
    tachometer has thousands of samples and few independent ones. Scale errors of the tachometer itself
    are not in it. Raises `DataError` for a signal that cannot be a shaft speed.
    """
    if speed_hz.size < MIN_TACHOMETER_SAMPLES:
        raise DataError(f"speed signal of {speed_hz.size} samples; {MIN_TACHOMETER_SAMPLES} are needed.")
    mean = float(np.mean(speed_hz))
    if not 0 < abs(mean) < LIMIT_HZ:
        raise DataError(f"speed signal with a mean of {mean * RPM_PER_HZ:.6g} rpm is not a shaft speed.")
    quarter = speed_hz.size // 4
    drift = float(np.mean(speed_hz[-quarter:]) - np.mean(speed_hz[:quarter]))
    sign = math.copysign(1.0, mean)  # fault lines do not depend on the direction of rotation
    # Means of at most `MAX_BLOCKS` equal blocks: their mean has the same scatter, and they are fewer.
    length = -(-speed_hz.size // MAX_BLOCKS)
    blocks = speed_hz[: speed_hz.size // length * length].reshape(-1, length).mean(axis=1)
    half = Z95 * math.sqrt(float(np.var(blocks)) * correlated_samples(blocks) / blocks.size)
    return ShaftSpeed(
        value_hz=abs(mean),
        ci95_hz=half,
        source=SpeedSource.TACHOMETER,
        drift_hz=sign * drift,
        spread_hz=float(np.std(speed_hz)),
    )


def correlated_samples(values: FloatArray) -> float:
    """Samples per independent sample: 1 + 2 times the sum of the autocorrelation up to its first zero."""
    from scipy import fft

    centred = values - np.mean(values)
    n = fft.next_fast_len(2 * len(centred), real=True)
    correlation = fft.irfft(np.abs(fft.rfft(centred, n)) ** 2, n)[: len(centred)]
    if correlation[0] <= 0:
        return 1.0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation <= 0)
    stop = int(negative[0]) if negative.size else len(centred)
    return float(1 + 2 * np.sum(correlation[1:stop]))


def profile_signal(time_s: FloatArray, speed_rad_s: FloatArray, seconds: float) -> SpeedSignal:
    """A prescribed speed, linear between its entries, sampled about every `PROFILE_STEP_S` over `seconds`."""
    count = math.ceil(seconds / PROFILE_STEP_S) + 1
    values = np.interp(np.linspace(0, seconds, count), time_s, speed_rad_s) / (2 * math.pi)
    return SpeedSignal(values_hz=values, rate_hz=(count - 1) / seconds)


def prescribed_speed(value_hz: float) -> ShaftSpeed:
    """The speed at which a simulation drove the shaft [Hz]."""
    return ShaftSpeed(value_hz=value_hz, ci95_hz=0.0, source=SpeedSource.PRESCRIBED)


def stated_speed(rpm: float, ci95_rpm: float) -> ShaftSpeed:
    """A measured value written down by somebody [rpm]; `ci95_rpm` covers its rounding."""
    return _scalar(rpm, ci95_rpm, SpeedSource.STATED)


def nominal_speed(rpm: float, ci95_pct: float) -> ShaftSpeed:
    """A set point [rpm]; `ci95_pct` is how far the data set's description trusts it."""
    return _scalar(rpm, rpm * ci95_pct / 100, SpeedSource.NOMINAL)


def _scalar(rpm: float, ci95_rpm: float, source: SpeedSource) -> ShaftSpeed:
    if not 0 < rpm < LIMIT_HZ * RPM_PER_HZ:
        raise DataError(f"shaft speed {rpm} rpm must be above 0 and below {LIMIT_HZ * RPM_PER_HZ:.0f}.")
    return ShaftSpeed(value_hz=rpm / RPM_PER_HZ, ci95_hz=ci95_rpm / RPM_PER_HZ, source=source)
