"""Runs of the scene `rig-oil`: losses by source against the drive's power and closed forms; light load."""

import json
import math

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.cli import main
from srbval.models import film
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import Step, simulate
from srbval.models.slices import slice_parameters, sliced_contacts
from srbval.scene import load_scene

CLOSED = 1e-3  # of the drive's power that no source accounts for
CLOSED_FORM = 0.03  # the kernel's roots of load and rate are the formula's powers to 1 %, loads change over a passage
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


def test_rolling_and_drag_cost_what_closed_forms_say(run: Run) -> None:
    """From the recorded loads, the kinematic speeds of rollers against races, and the cage's mean speed."""
    scene, oil = run.scene, run.scene.oil
    assert oil is not None
    geometry = load_bearing("skf-22240").geometry
    assert geometry is not None
    model, contacts = slice_parameters(scene, geometry), sliced_contacts(scene, geometry)
    cage, shaft, radius = float(run.cage_rad_s.mean()), scene.mean_shaft_rad_s, model.law.roller_radius
    rolling_m_s = 0.5 * (contacts[0].radius_m * cage + contacts[1].radius_m * (shaft - cage))
    turning = rolling_m_s / radius  # of a roller against its slot
    power_w = 0.0
    for race, contact, sign in zip((0, 1), contacts, (1, -1), strict=True):
        speed = cage if race == 0 else shaft - cage  # of the race against the slot, along the roller's axis
        rate = turning + sign * -1 * speed * model.tilt_cosine
        for loads in run.load_n[:, race].sum(axis=-1):
            power_w += sum(
                rate * contact.shape.rolling_couple_nm(oil, rate, load, contact.shape.length_m(load))
                for load in loads[loads > 1.0]
            ) / len(run.load_n)  # fmt: skip
    power_w *= film.thermal_factor(oil, rolling_m_s)
    assert run.power_w["rolling"] == pytest.approx(power_w, rel=CLOSED_FORM)
    speed = geometry.pitch_radius_m * cage
    force = 0.5 * oil.fill * oil.density_kg_m3 * oil.drag_coefficient * 2 * radius * geometry.roller_width_m * speed**2
    assert run.power_w["drag"] == pytest.approx(38 * force * speed, rel=CLOSED_FORM)


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


def test_the_command_prints_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "rig-oil", "--seconds", "0.05", "--dt", "1/40960", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["power_w"]) == KEYS
    assert set(found["film_um"]) == {"min", "mean"}
    assert np.isfinite([found["lambda_min"], found["slip_pct"]]).all()
