"""A path to the sensor: its response against closed forms, its file, and what is refused of one."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.models.run_file import scene_dict
from srbval.path.identify import path_toml
from srbval.scene import PathMode, SensorPath, load_scene, load_sensor_path, paper_scene

ROUNDING = 1e-12
MODE = PathMode(frequency_hz=1600.0, damping_ratio=0.03, gain=0.5)


def made(*modes: PathMode, direct: float = 0.8, covariance: tuple[tuple[float, ...], ...] = ()) -> SensorPath:
    return SensorPath(
        direct=direct, modes=modes, low_hz=400.0, high_hz=3150.0, source="test", used=("H", "OR"), covariance=covariance
    )


def test_far_below_a_mode_the_ring_and_far_above_it_both_ways() -> None:
    path = made(MODE)
    assert abs(path.response(np.array([1.0]))[0]) == pytest.approx(0.8, rel=1e-6)
    assert abs(path.response(np.array([1e6]))[0]) == pytest.approx(0.8 + 0.5, rel=1e-3)


def test_at_resonance_the_mass_follows_a_quarter_turn_behind() -> None:
    """Relative acceleration of a mass that its base drives: g f^2 / (- 2 i zeta f^2) = + i g / (2 zeta)."""
    found = made(MODE).response(np.array([1600.0]))[0]
    assert found.real == pytest.approx(0.8, rel=ROUNDING)
    assert found.imag == pytest.approx(0.5 / (2 * 0.03), rel=ROUNDING)  # a change of its sign is a negative damper


def test_below_resonance_a_positive_gain_takes_from_the_ring() -> None:
    assert abs(made(MODE).response(np.array([800.0]))[0]) < 0.8 < abs(made(MODE).response(np.array([2400.0]))[0])


def test_a_level_is_as_sure_as_its_parameters() -> None:
    """With the direct way alone u of the level is 8.69 dB times that of ln d."""
    level, u = made(covariance=((0.01,),)).level_db(np.array([500.0, 2000.0]))
    assert level == pytest.approx([20 * math.log10(0.8)] * 2)
    assert u == pytest.approx([8.686 * 0.1] * 2, rel=0.1)  # 400 draws know a deviation to 3.5 %
    assert made().level_db(np.array([500.0]))[1] == [0.0]


def test_a_file_comes_back_as_it_was(tmp_path: Path) -> None:
    path = made(MODE, covariance=tuple(tuple(0.01 * (i == j) for j in range(4)) for i in range(4)))
    (tmp_path / "path.toml").write_text(path_toml(path), encoding="utf-8")
    assert load_sensor_path(str(tmp_path / "path.toml")) == path
    scene = load_scene("rig", {"sensor_path": str(tmp_path / "path.toml")})
    assert scene.sensor_path == path
    assert json.loads(json.dumps(scene_dict(scene)))["sensor_path"]["modes"][0]["gain"] == 0.5


def test_none_is_the_scene_as_it_was() -> None:
    assert paper_scene(sensor_path="none") == paper_scene()
    assert "sensor_path" not in scene_dict(paper_scene())  # keys of what is stored stay as they were


def test_the_bundled_path_says_what_it_was_fitted_to() -> None:
    path = load_sensor_path("rig")
    assert [name.split("_")[0] for name in path.used] == ["H", "OR"]
    assert path.modes == ()  # one loud harmonic was all that a mode rested on
    assert path.covariance
    assert load_scene("rig", {"sensor_path": "rig"}).sensor_path == path


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"direct": 0.0}, "direct"),
        ({"low_hz": 4000.0}, "low_hz"),
        ({"modes": [vars(MODE)] * 4}, "the limit is 3"),
        ({"modes": [vars(MODE) | {"damping_ratio": 1.5}]}, "damping_ratio"),
        ({"modes": [vars(MODE) | {"frequency_hz": -5.0}]}, "frequency_hz"),
        ({"covariance": [[1.0, 0.0], [0.0, 1.0]]}, "1 rows"),
        ({"covariance": [[-1.0]]}, "variances"),
        ({"damping": 3}, "unknown key"),
    ],
)
def test_what_is_no_path_is_refused(changes: dict[str, object], said: str) -> None:
    table = {"direct": 1.0, "low_hz": 400.0, "high_hz": 3150.0, "source": "test"} | changes
    with pytest.raises(ConfigurationError, match=said):
        paper_scene(sensor_path=table)


def test_a_path_that_is_not_there() -> None:
    with pytest.raises(ConfigurationError, match=r"known: none, rig"):
        paper_scene(sensor_path="rigg")
    with pytest.raises(DataError, match="no such file"):
        paper_scene(sensor_path="./nothing.toml")
