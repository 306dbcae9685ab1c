"""What the sensor shows: levels of known tones in the bands, and the path's response, chunk by chunk as at once."""

import math

import numpy as np
import pytest

from srbval.models.sensor import FILTER_S, BandLevels, SensorFilter, along_sensor
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.reading.pipeline import one_signal
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import SENSOR_ANGLE_RAD, SensorPath, paper_scene

FS_HZ = 20480.0
TIME_S = np.arange(40960) / FS_HZ
STARTS = 5e-3  # what the filter's beginning takes from the sum over two seconds
NEAR_DB = 0.1  # of the response away from the edges of its bands
FLAT = 0.3  # of half a band, 0.5: beyond, its edge begins to show
DOWN = -math.pi / 2  # of the load
PATH = SensorPath(
    frequency_hz=tuple(10 ** (n / 10) for n in (31, 32, 33)), load=(0.5, 2.0, 1.2), cross=(2.0, 8.0, 3.0), source="test"
)


def accelerations(amplitude: float, frequency_hz: float, angle_rad: float) -> np.ndarray:
    tone = amplitude * np.sin(2 * np.pi * frequency_hz * TIME_S)
    return np.stack([tone * math.cos(angle_rad), tone * math.sin(angle_rad), 3 * tone], axis=1)


def levels_of(samples: np.ndarray, chunk: int) -> BandLevels:
    levels = BandLevels(fs_hz=FS_HZ)
    for first in range(0, len(samples), chunk):
        levels.add(along_sensor(samples[first : first + chunk]))
    return levels


@pytest.mark.parametrize(("band", "frequency_hz"), [("500-1500", 900.0), ("1400-2800", 2000.0)])
def test_a_tone_counts_in_its_band_alone(band, frequency_hz):
    rms = levels_of(accelerations(2.0, frequency_hz, SENSOR_ANGLE_RAD), 410).rms()
    assert rms[band] == pytest.approx(math.sqrt(2), rel=STARTS)
    assert all(value < 0.25 for name, value in rms.items() if name != band)


@pytest.mark.parametrize(("direction", "axis"), [(0, 1), (1, 0)])
def test_the_response_is_that_of_the_path_and_comes_half_a_filter_late(direction, axis):
    """Of an impulse along y, which is the load's, and along x, which is across it."""
    impulse = np.zeros((2**14, 3))
    impulse[0, axis] = 1 / math.cos(SENSOR_ANGLE_RAD)
    frequency = np.fft.rfftfreq(2**14, 1 / FS_HZ)
    late_s = round(0.5 * FILTER_S * FS_HZ) / FS_HZ
    found = np.fft.rfft(SensorFilter(PATH, FS_HZ, DOWN).add(impulse)) * np.exp(2j * np.pi * frequency * late_s)
    tenths = 10 * np.log10(frequency[1:])  # of a decade: bands are one wide
    inside = np.append(False, np.abs(tenths - np.rint(tenths)) < FLAT)
    expected = PATH.response(frequency)[direction]
    assert np.abs(20 * np.log10(np.abs(found / expected)))[inside].max() < NEAR_DB
    assert np.abs(np.angle(found / expected))[inside].max() < 0.02  # along the load in step, across it a quarter ahead


def test_the_path_makes_no_difference_of_chunks():
    samples = np.random.default_rng(1).standard_normal((3000, 3))
    parts = SensorFilter(PATH, FS_HZ, DOWN)
    joined = np.concatenate([parts.add(chunk) for chunk in np.array_split(samples, 7)])
    assert np.allclose(joined, SensorFilter(PATH, FS_HZ, DOWN).add(samples), rtol=1e-9, atol=1e-12)


def test_a_run_moves_as_without_a_path_and_its_file_holds_what_the_sensor_shows(tmp_path):
    scene = {"model": "impulse", "duration_s": 0.3, "defect": {"kind": "outer"}}
    plain = simulate(paper_scene(**scene), step=Step.UNCHECKED)
    table = {name: list(getattr(PATH, name)) for name in ("frequency_hz", "load", "cross")}
    behind = paper_scene(**scene, sensor_path=table | {"source": "test"})
    run = simulate(behind, step=Step.UNCHECKED)
    assert np.array_equal(run.acceleration_m_s2, plain.acceleration_m_s2)
    assert plain.sensor_m_s2.size == 0
    expected = SensorFilter(PATH, FS_HZ, DOWN).add(plain.acceleration_m_s2)
    assert np.allclose(run.sensor_m_s2, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert run.band_rms_m_s2["500-1500"] != plain.band_rms_m_s2["500-1500"]
    simulate_to_file(behind, tmp_path / "run.h5", step=Step.UNCHECKED)
    for recording in (recording_from_run(run), load_recording(tmp_path / "run.h5")):
        assert recording.channel == "sensor"
        assert np.array_equal(one_signal(recording), run.sensor_m_s2)
