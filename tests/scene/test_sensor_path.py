"""A path to the sensor: its response by hand, and its file."""

import json
import math

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.models.run_file import scene_dict
from srbval.path.identify import path_toml
from srbval.scene import SENSOR_ANGLE_RAD, SensorPath, load_scene, paper_scene, parts_along_sensor

MIDDLES_HZ = (1000.0, 1258.9254, 1584.8932)
TABLE = {"frequency_hz": list(MIDDLES_HZ), "load": [2.0, 0.5, 1.0], "cross": [6.0, 1.5, 3.0], "source": "test"}


def made(**changes: object) -> SensorPath:
    columns = {name: tuple(TABLE[name]) for name in ("frequency_hz", "load", "cross")}
    return SensorPath(**columns | {"source": "test"} | changes)


def test_each_band_has_its_gains_and_outside_them_nothing_is_changed():
    found = made().response(np.array([0.0, 880.0, 900.0, 1100.0, 1130.0, 1600.0, 1770.0, 1790.0, 5000.0]))
    assert found[0].tolist() == [1, 1, 2, 2, 0.5, 1, 1, 1, 1]  # edges at 891, 1122 and 1778 Hz
    assert found[1].tolist() == [1, 1, 6j, 6j, 1.5j, 3j, 3j, 1, 1]  # a quarter turn: powers of both directions add


def test_the_parts_along_the_sensor_are_those_of_the_load_and_across_it():
    """Under a load along -y what the ring does along y is the load's; the sensor sees each times cos 45 degrees."""
    ring = np.array([[3.0, 0.0, 5.0], [0.0, 2.0, 5.0]])
    assert parts_along_sensor(ring, -math.pi / 2) == pytest.approx(np.sqrt(0.5) * np.array([[0, 3.0], [2.0, 0]]))
    sensor = ring[:, :2] @ [math.cos(SENSOR_ANGLE_RAD), math.sin(SENSOR_ANGLE_RAD)]
    assert parts_along_sensor(ring, 0.7).sum(axis=1) == pytest.approx(sensor)


def test_paths_are_drawn_as_widely_as_they_are_known():
    random = np.random.default_rng(1)
    drawn = [made(u_db=(1.0, 0.0, 3.0), cross_u_db=2.0).drawn(random) for _ in range(400)]
    off = 20 * np.log10([np.array(one.load) / TABLE["load"] for one in drawn])
    ratio = 20 * np.log10([one.cross[0] / one.load[0] / 3.0 for one in drawn])
    assert off.std(axis=0) == pytest.approx([1.0, 0.0, 3.0], rel=0.1)  # 400 draws know a deviation to 3.5 %
    assert ratio.std() == pytest.approx(2.0, rel=0.1)


def test_a_file_comes_back_as_it_was(tmp_path):
    path = made(u_db=(0.5, 1.0, 2.0), cross_u_db=1.5, used=("OR",))
    (tmp_path / "path.toml").write_text(path_toml(path), encoding="utf-8")
    scene = load_scene("rig", {"sensor_path": str(tmp_path / "path.toml")})
    read = scene.sensor_path
    assert read is not None
    assert read.frequency_hz == pytest.approx(MIDDLES_HZ, rel=1e-5)
    assert (read.load, read.cross, read.u_db, read.used) == (path.load, path.cross, path.u_db, path.used)
    assert json.loads(json.dumps(scene_dict(scene)))["sensor_path"]["cross"] == [6.0, 1.5, 3.0]
    assert paper_scene(sensor_path="none") == paper_scene()
    with pytest.raises(DataError, match="no such file"):
        paper_scene(sensor_path="./nothing.toml")
    assert "sensor_path" not in scene_dict(paper_scene()), "stored keys of scenes without a path"


def test_the_bundled_path_says_what_it_was_fitted_to():
    path = load_scene("rig", {"sensor_path": "rig"}).sensor_path
    assert path.used == ("OR_877rpm_sample", "IR_877rpm_sample (direction)")
    assert path.frequency_hz[0] == pytest.approx(794, abs=1)  # below, a third octave is narrower than two lines of BPFO
    assert len(path.u_db) == len(path.load)
