"""Vibration in the analysis bands: tones of known level, and the same sum chunk by chunk as at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from srbval.models.band_levels import BANDS_HZ, SENSOR_ANGLE_RAD, BandLevels, along_sensor, band_rms

FS_HZ = 20480.0
TIME_S = np.arange(40960) / FS_HZ
STARTS = 5e-3  # what the filter's beginning takes from the sum over two seconds
RECORDED = 1.05  # what taking means over the intervals costs at 2 kHz, and a filter's edges


def accelerations(amplitude: float, frequency_hz: float, angle_rad: float) -> np.ndarray:
    tone = amplitude * np.sin(2 * np.pi * frequency_hz * TIME_S)
    return np.stack([tone * math.cos(angle_rad), tone * math.sin(angle_rad), 3 * tone], axis=1)


def levels_of(samples: np.ndarray, chunk: int) -> BandLevels:
    levels = BandLevels(fs_hz=FS_HZ)
    for first in range(0, len(samples), chunk):
        levels.add(along_sensor(samples[first : first + chunk]))
    return levels


@pytest.mark.parametrize(("band", "frequency_hz"), [("500-1500", 900.0), ("1400-2800", 2000.0)])
def test_a_tone_counts_in_its_band_alone(band: str, frequency_hz: float) -> None:
    rms = levels_of(accelerations(2.0, frequency_hz, SENSOR_ANGLE_RAD), 410).rms()
    assert rms[band] == pytest.approx(math.sqrt(2), rel=STARTS)
    assert all(value < 0.25 for name, value in rms.items() if name != band)


def test_only_the_component_along_the_sensor_counts() -> None:
    across = accelerations(2.0, 900.0, SENSOR_ANGLE_RAD + math.pi / 2)
    assert np.abs(along_sensor(across)).max() < 1e-12
    assert levels_of(across, 410).rms()["500-1500"] < 1e-12


def test_chunks_do_not_matter() -> None:
    noise = np.random.default_rng(1).standard_normal((8192, 3))
    whole, parts = levels_of(noise, 8192).rms(), levels_of(noise, 37).rms()
    assert parts == pytest.approx(whole, rel=1e-12)


def test_agrees_with_the_whole_record() -> None:
    noise = np.random.default_rng(2).standard_normal((len(TIME_S), 3))
    rms = levels_of(noise, 410).rms()
    for name, band_hz in BANDS_HZ.items():
        assert band_rms(along_sensor(noise), FS_HZ, band_hz) == pytest.approx(rms[name], rel=RECORDED - 1)


def test_a_band_beyond_half_the_rate_has_no_level() -> None:
    levels = BandLevels(fs_hz=4096.0)
    levels.add(np.ones(100))
    assert math.isnan(levels.rms()["1400-2800"])
    assert not math.isnan(levels.rms()["500-1500"])
