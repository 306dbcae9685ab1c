"""What the sensor shows: levels of known tones in the bands, and the path's response, chunk by chunk as at once."""

import math
from pathlib import Path

import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.models.sensor import BandLevels, SensorFilter, along_sensor, band_rms
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.reading.pipeline import one_signal
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD, PathMode, SensorPath, paper_scene

FS_HZ = 20480.0
TIME_S = np.arange(40960) / FS_HZ
STARTS = 5e-3  # what the filter's beginning takes from the sum over two seconds
RECORDED = 1.05  # what taking means over the intervals costs at 2 kHz, and a filter's edges
NEAR_DB = 0.1  # of the response in 400 to 3150 Hz
PATH = SensorPath(
    direct=0.8, low_hz=400.0, high_hz=3150.0, source="test",
    modes=(PathMode(frequency_hz=900.0, damping_ratio=0.05, gain=0.4),
           PathMode(frequency_hz=2900.0, damping_ratio=0.02, gain=-0.3)),
)  # fmt: skip


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


def test_the_response_is_that_of_the_theory() -> None:
    impulse = np.zeros(2**15)
    impulse[0] = 1.0
    found = np.fft.rfft(SensorFilter(PATH, FS_HZ).add(impulse))
    frequency = np.fft.rfftfreq(impulse.size, 1 / FS_HZ)
    band = (frequency > 400) & (frequency < 3150)
    expected = PATH.response(frequency[band])
    assert np.abs(20 * np.log10(np.abs(found[band] / expected))).max() < NEAR_DB
    assert np.abs(np.angle(found[band] / expected)).max() < 0.02


def test_the_path_makes_no_difference_of_chunks() -> None:
    samples = np.random.default_rng(1).standard_normal(1000)
    parts = SensorFilter(PATH, FS_HZ)
    joined = np.concatenate([parts.add(chunk) for chunk in np.array_split(samples, 7)])
    assert np.allclose(joined, SensorFilter(PATH, FS_HZ).add(samples), rtol=1e-12)


def test_a_mode_beyond_the_rate_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="raise output_rate"):
        SensorFilter(PATH, 6000.0)


def test_a_run_moves_as_without_a_path_and_its_file_holds_what_the_sensor_shows(tmp_path: Path) -> None:
    scene = {"model": "impulse", "duration_s": 0.3, "defect": {"kind": "outer"}}
    plain = simulate(paper_scene(**scene), step=Step.UNCHECKED)
    table = {name: getattr(PATH, name) for name in ("direct", "low_hz", "high_hz", "source")}
    behind = paper_scene(**scene, sensor_path=table | {"modes": [vars(mode) for mode in PATH.modes]})
    run = simulate(behind, step=Step.UNCHECKED)
    assert np.array_equal(run.acceleration_m_s2, plain.acceleration_m_s2)
    assert plain.sensor_m_s2.size == 0
    expected = SensorFilter(PATH, FS_HZ).add(along_sensor(plain.acceleration_m_s2))
    assert np.allclose(run.sensor_m_s2, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert run.band_rms_m_s2["500-1500"] != plain.band_rms_m_s2["500-1500"]
    simulate_to_file(behind, tmp_path / "run.h5", step=Step.UNCHECKED)
    for recording in (recording_from_run(run), load_recording(tmp_path / "run.h5")):
        assert recording.channel == "sensor"
        assert np.array_equal(one_signal(recording), run.sensor_m_s2)
