"""Shaft speed from a tachometer signal, from a stated value or from a set point."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.recording import ShaftSpeed, SpeedSignal, SpeedSource

RPM_PER_HZ = 60.0
Z95 = 1.96
MIN_TACHOMETER_SAMPLES = 8
PROFILE_STEP_S = 1e-3
LIMIT_HZ = 2000.0  # above the speed of any rolling bearing
# Share that a counting tachometer's speed may be off by its scale (95 %): its own quartz clock and the recorder's, 50
# parts in a million each and a little more for warmth and age. Stated, not measured; an analogue one may be worse.
SCALE_CI95 = 1e-4


def tachometer_speed(speed_hz: FloatArray) -> ShaftSpeed:
    """Mean of a tachometer signal [Hz], evenly sampled, with its 95 % interval and drift.

    The interval is that of the mean over this very signal: clocks (`SCALE_CI95`) and the sensor's noise, white noise
    whose variance is a sixth of that of the second differences. How the shaft's speed varies meanwhile (`spread_hz`) is
    no error of it. Raises `DataError` for a signal that cannot be a shaft speed.
    """
    if speed_hz.size < MIN_TACHOMETER_SAMPLES:
        raise DataError(f"speed signal of {speed_hz.size} samples; {MIN_TACHOMETER_SAMPLES} are needed.")
    mean = float(np.mean(speed_hz))
    if not 0 < abs(mean) < LIMIT_HZ:
        raise DataError(f"speed signal with a mean of {mean * RPM_PER_HZ:.6g} rpm is not a shaft speed.")
    quarter = speed_hz.size // 4
    drift = float(np.mean(speed_hz[-quarter:]) - np.mean(speed_hz[:quarter]))
    sign = math.copysign(1.0, mean)  # fault lines do not depend on the direction of rotation
    noise = Z95 * math.sqrt(float(np.mean(np.diff(speed_hz, 2) ** 2)) / 6 / speed_hz.size)
    return ShaftSpeed(
        value_hz=abs(mean),
        ci95_hz=math.hypot(noise, SCALE_CI95 * mean),
        source=SpeedSource.TACHOMETER,
        drift_hz=sign * drift,
        spread_hz=float(np.std(speed_hz)),
    )


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
