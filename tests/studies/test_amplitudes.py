"""The study of amplitudes: what is counted, and paths that are drawn."""

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.comparison import QuantityValue
from srbval.path.amplitudes import levels
from srbval.recordings import Origin, Recording
from srbval.scene import PathMode, SensorPath, load_scene
from srbval.studies.amplitudes.study import _shares
from srbval.studies.rig_amplitudes import PATH_DRAWS, drawn_paths, moved_path, rows, turned


def test_only_what_the_record_shows_is_counted() -> None:
    rig = {
        "1000 Hz": QuantityValue(value=-20.0), "1259 Hz": QuantityValue(value=-20.0),
        "1585 Hz": QuantityValue(value=-20.0, present=False), "harmonic 2": QuantityValue(value=-3.0),
    }  # fmt: skip
    model = {"1000 Hz": -17.0, "1259 Hz": -25.0, "1585 Hz": 0.0, "harmonic 2": -3.5}
    shown = {name: QuantityValue(value=value) for name, value in model.items()}
    compared = rows(rig, shown, {}, record="IR", fault=Fault.INNER, used_for="withheld")
    octaves, harmonics = _shares(compared, "path")
    names = ("kind", "used_for", "resolved", "near", "mean_error")
    assert [octaves[name] for name in names] == ["third octaves", "withheld", 2, 1, -1.0]
    assert octaves["crps"] == pytest.approx(4.0)  # of points: 3 and 5 dB off
    assert [harmonics[name] for name in names] == ["harmonic pattern", "withheld", 1, 1, -0.5]


def test_a_path_moves_with_its_parameters_and_what_is_none_is_left_out() -> None:
    mode = PathMode(frequency_hz=1000.0, damping_ratio=0.05, gain=0.3)
    path = SensorPath(direct=1.0, modes=(mode,), low_hz=400.0, high_hz=3150.0, source="test")
    assert moved_path(path, path.parameters) is not None
    moved = moved_path(path, path.parameters + np.array([0.1, 0.0, 0.0, 0.0]))
    assert moved.direct > 1.1
    assert moved_path(path, path.parameters + np.array([0.0, 5.0, 0.0, 0.0])) is None


def test_paths_are_drawn_about_the_identified_one() -> None:
    path = load_scene("rig", {"sensor_path": "rig"}).sensor_path
    drawn = drawn_paths(path)
    assert PATH_DRAWS // 2 < len(drawn) <= PATH_DRAWS
    gains = np.log([one.direct for one in drawn])
    assert np.std(gains) == pytest.approx(path.deviations()[0], rel=0.5)
    assert np.mean(gains) == pytest.approx(np.log(path.direct), abs=path.deviations()[0])


def test_turned_phases_keep_every_level_and_draw_pulses_out() -> None:
    pulses = np.zeros(20_480)
    pulses[::205] = 1.0  # a line of 99.9 Hz
    record = Recording(
        name="pulses", channels={"sensor": pulses}, channel="sensor", fs_hz=20_480.0, unit="m/s2", dataset="test",
        origin=Origin.SIMULATED,
    )  # fmt: skip
    drawn_out = turned(record, 20_480 / 205, seed=1)
    for name, level in levels(drawn_out, None).items():
        assert level.value == pytest.approx(levels(record, None)[name].value, abs=0.3)
    assert np.abs(drawn_out.channels["sensor"]).max() < 0.5
