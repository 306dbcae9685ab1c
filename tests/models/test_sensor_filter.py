"""The path to the sensor in time: the response of its theory, chunk by chunk as at once, and nothing where none is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.models.band_levels import along_sensor
from srbval.models.sensor_filter import SensorFilter
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.reading.pipeline import one_signal
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import PathMode, SensorPath, paper_scene

FS_HZ = 20480.0
NEAR_DB = 0.1  # of the response in 400 to 3150 Hz
PATH = SensorPath(
    direct=0.8, low_hz=400.0, high_hz=3150.0, source="test",
    modes=(PathMode(frequency_hz=900.0, damping_ratio=0.05, gain=0.4),
           PathMode(frequency_hz=2900.0, damping_ratio=0.02, gain=-0.3)),
)  # fmt: skip


def test_the_response_is_that_of_the_theory() -> None:
    impulse = np.zeros(2**15)
    impulse[0] = 1.0
    found = np.fft.rfft(SensorFilter(PATH, FS_HZ).add(impulse))
    frequency = np.fft.rfftfreq(impulse.size, 1 / FS_HZ)
    band = (frequency > 400) & (frequency < 3150)
    expected = PATH.response(frequency[band])
    assert np.abs(20 * np.log10(np.abs(found[band] / expected))).max() < NEAR_DB
    assert np.abs(np.angle(found[band] / expected)).max() < 0.02


def test_chunks_make_no_difference() -> None:
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
