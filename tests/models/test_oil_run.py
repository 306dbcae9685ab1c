"""Runs of the scene `rig-oil`: losses by source against the drive's power and closed forms; light load."""

import math

import pytest

from srbval.bearing import load_bearing
from srbval.models import film
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import Step, simulate
from srbval.scene import load_scene

CLOSED = 1e-3  # of the drive's power that no source accounts for
SETTLED = {"duration": "0.1 s", "settle": "0.1 s", "detail_rate": "512 Hz"}
KEYS = {"sliding", "rolling", "drag", "cage", "seals", "damping", "total"}


@pytest.fixture(scope="module")
def run() -> Run:
    return simulate(load_scene("rig-oil", SETTLED), step=Step.UNCHECKED)


def test_sources_add_up_to_the_drives_power(run: Run) -> None:
    assert run.status is RunStatus.OK
    assert set(run.power_w) == KEYS
    assert all(run.power_w[name] > 0 for name in KEYS - {"seals"})
    assert run.power_w["seals"] == 0
    assert run.power_w["total"] == pytest.approx(run.drive_power_w, rel=CLOSED)
    assert run.power_w["total"] == pytest.approx(sum(v for k, v in run.power_w.items() if k != "total"), rel=1e-12)


def test_films_are_the_formulas(run: Run) -> None:
    assert run.scene.oil is not None
    assert run.lambda_min == pytest.approx(run.film_um["min"] * 1e-6 / run.scene.oil.roughness_m, rel=1e-12)
    assert run.film_um["min"] < run.film_um["mean"]
    heaviest = float(run.load_n.sum(axis=-1).max()) / 0.0325  # per length that touches
    line = film.line_film_m(run.scene.oil, 6.2, heaviest, 0.0172) * film.thermal_factor(run.scene.oil, 6.2)
    assert 0.7 < run.film_um["mean"] * 1e-6 / line < 1.1  # an ellipse's, at less load


def test_a_light_load_skids_and_is_warned_of(run: Run) -> None:
    light = simulate(load_scene("rig-oil", SETTLED | {"load": {"radial": "0.2 kN"}}), step=Step.UNCHECKED)
    assert light.status is RunStatus.SKIDDING
    assert light.slip_pct > 1.5
    assert "the catalogue's minimum at this speed is 11.4 kN" in light.reason
    assert "catalogue" not in run.reason


def test_minimum_load_of_the_catalogue() -> None:
    """SKF Rolling bearings: 5.8 kN at 339 and 11.4 kN at 859 rpm of a 22240."""
    ratings = load_bearing("skf-22240").ratings
    assert ratings is not None
    for rpm, expected in ((339, 5.79e3), (859, 11.43e3)):
        assert ratings.minimum_load_n(rpm * math.pi / 30) == pytest.approx(expected, rel=1e-3)
