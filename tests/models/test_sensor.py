"""A path to the sensor and its file; what the sensor shows behind it, chunk by chunk as at once."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from srbval.butterworth import FILTER_ORDER
from srbval.errors import DataError
from srbval.models import sensor
from srbval.models.impulse import _move_mass
from srbval.models.run_file import scene_dict
from srbval.models.sensor import FILTER_S, BandLevels, SensorFilter, band_squares
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.path.identify import path_toml
from srbval.reading.pipeline import one_signal
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import BANDS_HZ, SENSOR_ANGLE_RAD, SensorPath, load_scene, paper_scene

FS_HZ = 20480.0
ENDS = 0.01  # of a band's RMS, by the ends of three pieces of a third of a second
NEAR_DB = 0.1  # of the response away from the edges of its bands
FLAT = 0.3  # of half a band, 0.5: beyond, its edge begins to show
DOWN = -math.pi / 2  # of the load
MIDDLES_HZ = tuple(10 ** (n / 10) for n in (31, 32, 33))
PATH = SensorPath(frequency_hz=MIDDLES_HZ, load=(0.5, 2.0, 1.2), cross=(2.0, 8.0, 3.0), source="test")


@pytest.mark.parametrize("fs_hz", [5800.0, FS_HZ, 245_760.0])
@pytest.mark.parametrize("band", BANDS_HZ)
def test_band_filters_are_those_of_scipy(band, fs_hz, monkeypatch):
    """Forward and backward, except at the ends, and for the RMS the gain of the causal filter, in pieces."""
    samples, levels = 1 + np.random.default_rng(2).standard_normal(round(fs_hz)), BandLevels(fs_hz=fs_hz)
    monkeypatch.setattr(sensor, "PIECE", samples.size // 3)
    for part in np.array_split(samples, 7):
        levels.add(part)
    sections = scipy.signal.butter(FILTER_ORDER, BANDS_HZ[band], "bandpass", fs=fs_hz, output="sos")
    passed = scipy.signal.sosfilt(sections, samples)
    assert levels.rms()[band] == pytest.approx(math.sqrt(np.mean(passed**2)), rel=ENDS)
    expected = scipy.signal.sosfiltfilt(sections, samples) ** 2
    found, end = band_squares(samples, fs_hz, BANDS_HZ[band]), round(0.1 * fs_hz)
    np.testing.assert_allclose(found[end:-end], expected[end:-end], rtol=0, atol=1e-6 * expected.max())


def test_a_mass_moves_as_the_differential_equation_says():
    """Against scipy's `lsim`, exact for a force that is linear between samples."""
    force, time_s = np.random.default_rng(3).standard_normal((2000, 2)), np.arange(2000) / FS_HZ
    found = _move_mass(paper_scene(output_rate_hz=FS_HZ), 50.0, np.diag([4e8, 9e8]), np.diag([2e4, 1e4]), force)
    for axis, (stiffness, damping) in enumerate(((4e8, 2e4), (9e8, 1e4))):
        motion = np.array([[0.0, 1.0], [-stiffness / 50, -damping / 50]]), [[0.0], [1 / 50]], [[0.0, 1.0]], [[0.0]]
        _, expected, _ = scipy.signal.lsim(motion, force[:, axis] - force[0, axis], time_s)
        np.testing.assert_allclose(found[:, axis], expected, rtol=0, atol=1e-8 * np.abs(expected).max())


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


def test_each_band_has_its_gains_and_outside_them_nothing_is_changed():
    found = PATH.response(np.array([0.0, 1100.0, 1130.0, 1400.0, 1420.0, 1790.0, 2230.0, 2250.0, 5000.0]))
    assert found[0].tolist() == [1, 1, 0.5, 0.5, 2, 1.2, 1.2, 1, 1]  # edges at 1122, 1413, 1778 and 2239 Hz
    assert found[1].tolist() == [1, 1, 2j, 2j, 8j, 3j, 3j, 1, 1]  # a quarter turn: powers of both directions add


def test_paths_are_drawn_as_widely_as_they_are_known():
    random = np.random.default_rng(1)
    drawn = [replace(PATH, u_db=(1.0, 0.0, 3.0), cross_u_db=2.0).drawn(random) for _ in range(400)]
    off = 20 * np.log10([np.array(one.load) / PATH.load for one in drawn])
    ratio = 20 * np.log10([one.cross[0] / one.load[0] / 4.0 for one in drawn])
    assert off.std(axis=0) == pytest.approx([1.0, 0.0, 3.0], rel=0.1)  # 400 draws know a deviation to 3.5 %
    assert ratio.std() == pytest.approx(2.0, rel=0.1)


def test_a_file_comes_back_as_it_was(tmp_path):
    path = replace(PATH, u_db=(0.5, 1.0, 2.0), cross_u_db=1.5, used=("OR",))
    (tmp_path / "path.toml").write_text(path_toml(path), encoding="utf-8")
    scene = load_scene("rig", {"sensor_path": str(tmp_path / "path.toml")})
    read = scene.sensor_path
    assert read is not None
    assert read.frequency_hz == pytest.approx(MIDDLES_HZ, rel=1e-5)
    assert (read.load, read.cross, read.u_db, read.used) == (path.load, path.cross, path.u_db, path.used)
    assert json.loads(json.dumps(scene_dict(scene)))["sensor_path"]["cross"] == [2.0, 8.0, 3.0]
    assert paper_scene(sensor_path="none") == paper_scene()
    with pytest.raises(DataError, match="no such file"):
        paper_scene(sensor_path="./nothing.toml")
    assert "sensor_path" not in scene_dict(paper_scene()), "stored keys of scenes without a path"
