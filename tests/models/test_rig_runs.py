"""Runs of the rig with oil and with rollers that tilt and slide: power closes, losses by source, films, loads."""

import math

import pytest

from srbval import RunStatus, load_bearing, load_scene
from srbval.models.oil import line_film_m, thermal_factor
from srbval.models.simulate import Step, simulate

CLOSED = 1e-3  # of the drive's power that no source accounts for
SETTLED = {"duration": "0.1 s", "settle": "0.1 s", "detail_rate": "512 Hz"}
KEYS = {"sliding", "rolling", "drag", "cage", "seals", "damping", "total"}


@pytest.fixture(scope="module")
def run():
    return simulate(load_scene("rig-oil", SETTLED), step=Step.UNCHECKED)


def test_sources_add_up_to_the_drives_power(run):
    assert run.status is RunStatus.OK
    assert set(run.power_w) == KEYS
    assert all(run.power_w[name] > 0 for name in KEYS - {"seals"})
    assert run.power_w["seals"] == 0
    assert run.power_w["total"] == pytest.approx(run.drive_power_w, rel=CLOSED)
    assert run.power_w["total"] == pytest.approx(sum(v for k, v in run.power_w.items() if k != "total"), rel=1e-12)


def test_films_are_the_formulas(run):
    assert run.lambda_min == pytest.approx(run.film_um["min"] * 1e-6 / run.scene.oil.roughness_m, rel=1e-12)
    assert run.film_um["min"] < run.film_um["mean"]
    heaviest = float(run.load_n.sum(axis=-1).max()) / 0.0325  # per length that touches
    line = line_film_m(run.scene.oil, 6.2, heaviest, 0.0172) * thermal_factor(run.scene.oil, 6.2)
    assert 0.7 < run.film_um["mean"] * 1e-6 / line < 1.1  # an ellipse's, at less load


def test_a_light_load_skids_and_is_warned_of(run):
    light = simulate(load_scene("rig-oil", SETTLED | {"load": {"radial": "0.2 kN"}}), step=Step.UNCHECKED)
    assert light.status is RunStatus.SKIDDING
    assert light.slip_pct > 1.5
    assert "the catalogue's minimum at this speed is 11.4 kN" in light.reason
    assert "catalogue" not in run.reason


def test_minimum_load_of_the_catalogue():
    """SKF Rolling bearings: 5.8 kN at 339 and 11.4 kN at 859 rpm of a 22240."""
    ratings = load_bearing("skf-22240").ratings
    assert ratings is not None
    for rpm, expected in ((339, 5.79e3), (859, 11.43e3)):
        assert ratings.minimum_load_n(rpm * math.pi / 30) == pytest.approx(expected, rel=1e-3)


SHARE, SHARE_OFF = 0.244, 0.01  # of row 1: the closed form of `test_free_rollers`; rollers come and go
AXIAL = {"bodies": {"free_rollers": True, "cages": 1}, "load": {"axial": "12.5 kN"}, "solver": {"step_s": 1 / 81920}}


@pytest.mark.long_form  # needs kernels of its own: `.ci/run` runs the first
@pytest.mark.parametrize("name", ["rig", "rig-oil"])
def test_power_closes_and_the_loaded_row_carries(name):
    run = simulate(load_scene(name, AXIAL | {"duration": "0.1 s", "settle": "0.1 s"}), step=Step.UNCHECKED)
    assert run.status is RunStatus.OK
    assert abs(run.energy_imbalance) < CLOSED
    assert run.free_rollers["row_1_share"] == pytest.approx(SHARE, abs=SHARE_OFF)
    assert 0.1 < run.free_rollers["tilt_mrad"] < 1
    assert 10 < run.free_rollers["shift_um"] < 100
    assert run.free_rollers["skew_nm"] > 0
    assert not simulate(load_scene(name, {"duration": "1 ms", "settle": "0 s"}), step=Step.UNCHECKED).free_rollers
