import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.budget import STUDY
from srbval.comparison.comparison import QuantityValue
from srbval.comparison.counterpart import CONVERGED_POINTS, converged, load_ensemble
from srbval.comparison.effects import INPUTS, sensitivity_of
from srbval.errors import NumericsError
from srbval.scene import paper_scene
from srbval.storage.json_files import to_json
from srbval.studies import input_effects as sensitivity
from srbval.studies.input_effects import grid_ci95, measure
from srbval.studies.open_inputs import open_inputs

SCENE = paper_scene(defect={"kind": "outer"})
UNIFORM = 1 / np.sqrt(12)  # standard deviation of a uniform variable over one
EMULATED = 0.1  # relative, of moments over a Latin hypercube of 48


def analytic(chaos=0.0):
    """A stand-in for runs: the cage ratio and a level as known functions of the inputs, of points and of the step."""
    rng = np.random.default_rng(5)

    def run(scene, band_hz=None):
        load = scene.load.radial_n / SCENE.load.radial_n - 1
        points = 1 + 10.0 * (scene.contact.points_per_circle / 500) ** -2
        speed = np.log10(scene.contact.critical_velocity_m_s / 1e-3)
        cage = 0.43 + 1e-3 * speed - 1e-5 * points
        level = -3 + 2 * speed + 50 * load + (0 if band_hz is None else 0.01 * (band_hz[0] - 500))
        values = {"cage ratio": cage, "2xBPFO": level + chaos * rng.standard_normal()}
        return SimpleNamespace(
            values={name: QuantityValue(value=value) for name, value in values.items()}, analysis=None
        )

    return run


def measured(monkeypatch, run, **options):
    monkeypatch.setattr(sensitivity, "run_unchecked", run)
    monkeypatch.setattr(sensitivity, "halves_of", lambda *_: np.zeros((2, 4)))
    return measure(scene=SCENE, **options).of(Fault.OUTER)


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        return measured(patch, analytic())


def test_inputs_move_quantities_together_and_by_as_much_as_they_do(found):
    cage, level = found.of("cage ratio"), found.of("2xBPFO")
    (velocity,) = (one for one in open_inputs() if one.name == "critical velocity of friction")
    decades = np.log10(velocity.high / velocity.low)
    assert cage.deviation == pytest.approx(1e-3 * decades * UNIFORM, rel=EMULATED)
    assert cage.shift == pytest.approx(1e-3 * decades / 2, rel=EMULATED)  # the nominal value is an end of the range
    parts = (2 * decades * UNIFORM, 50 * 0.04 * UNIFORM, 0.01 * 200 * UNIFORM)
    assert level.deviation == pytest.approx(np.hypot(np.hypot(*parts[:2]), parts[2]), rel=EMULATED)
    assert level.shares["critical velocity of friction"] == pytest.approx((parts[0] / level.deviation) ** 2, abs=0.1)
    assert level.shares["friction"] < 0.05
    (_, both), _ = np.corrcoef(found.deviations(["cage ratio", "2xBPFO"]).T)
    assert both == pytest.approx(parts[0] / level.deviation, abs=0.1)
    assert found.deviations(["cage ratio"]).std() == pytest.approx(cage.deviation, rel=EMULATED)
    # Uniform: 95 % lie within 0.95 of half the range, where a normal one would have 1.96 of 0.577 of it.
    assert found.parts_ci95("cage ratio")[INPUTS] == pytest.approx(0.95 * 1e-3 * decades / 2, rel=EMULATED)


def test_points_are_an_offset_with_a_sign_and_the_rest_an_index(found):
    cage = found.of("cage ratio")
    at = {n: -1e-5 * (1 + 10.0 * (n / 500) ** -2) for n in (500, 1000, 2000, 4000)}
    assert cage.value == pytest.approx(0.43 + at[2000], abs=1e-9)
    assert cage.paper_points == pytest.approx(at[500] - at[2000], rel=1e-6)
    assert cage.grid_ci95 == pytest.approx(grid_ci95(at[2000], at[1000], at[4000]), rel=1e-6)
    assert cage.grid_ci95 > abs(at[2000] + 1e-5)  # second order: the index covers what is left to infinitely many


def test_what_starts_scatter_is_in_the_deviation_and_draws_again(found, monkeypatch):
    """Chaos that no emulator follows: more than half of the deviation is left over."""
    chaotic = measured(monkeypatch, analytic(1.5), draws=20)
    quiet, loud = (one.of("2xBPFO") for one in (found, chaotic))
    assert loud.start_sd == pytest.approx(1.5, rel=0.7)  # of eight
    assert loud.deviation > np.hypot(quiet.deviation, 1.0)
    assert (found.refined, chaotic.refined, chaotic.draws) == (False, True, 20 * STUDY.rounds)


def test_draws_that_fail_are_counted_and_too_many_are_an_error(monkeypatch):
    run, asked = analytic(), []

    def failing(scene, band_hz=None):
        asked.append(band_hz)
        if band_hz is not None and len(asked) % 4 == 0:
            raise NumericsError("crushed")
        return run(scene, band_hz)

    found = measured(monkeypatch, failing, draws=24)
    assert (found.draws, found.failed) == (18, 6)
    with pytest.raises(NumericsError, match="draws could be run"):
        measure(scene=SCENE, draws=14)


def test_stored_and_read_again_it_is_the_same(found):
    again = sensitivity_of({"defects": [to_json(found)]}).of(Fault.OUTER)
    assert again.quantities == found.quantities
    names = ["2xBPFO", "cage ratio"]
    assert again.deviations(names) == pytest.approx(found.deviations(names))


def test_grid_convergence_index_of_a_known_order():
    """Values 1 + h^2 at h = 4, 2, 1: the middle one is 4 off; 1.25 times that is the index."""
    assert grid_ci95(5.0, 17.0, 2.0) == pytest.approx(1.25 * 4.0)
    assert grid_ci95(1.0, 1.0, 1.0) == 0.0
    assert grid_ci95(1.0, 0.0, 0.5) > 1.25 * 0.5  # not from one side: the lowest order


def test_converged_points_hold_stiffness_and_the_defect_s_length():
    base, fine = SCENE.contact, converged(SCENE).contact
    assert fine.points_per_circle == CONVERGED_POINTS
    assert fine.stiffness_n_m * fine.points_per_circle == pytest.approx(base.stiffness_n_m * base.points_per_circle)
    assert fine.damping_ns_m * fine.points_per_circle == pytest.approx(base.damping_ns_m * base.points_per_circle)
    assert converged(SCENE).defect.points == SCENE.defect.points * CONVERGED_POINTS // base.points_per_circle
    assert converged(converged(SCENE)) == converged(SCENE)
    slices = dataclasses.replace(SCENE, model="slices")
    assert converged(slices) is slices


@pytest.mark.slow
def test_the_paper_s_points_make_runs_chaotic_and_converged_ones_do_not():
    """Eight starts of 14 turns each: at 500 points levels scatter, at 2000 they repeat to a thousandth of a decibel."""
    short = dataclasses.replace(SCENE, duration_s=1.0, shaft_speed_rad_s=90.0)
    spread = {}
    for name, scene in (("paper", short), ("converged", converged(short))):
        levels = [sensitivity.values_of(sensitivity.run_unchecked(one))["4xBPFO"] for one in load_ensemble(scene)[:4]]
        spread[name] = np.std(levels)
    assert spread["converged"] < 0.01 < 0.1 < spread["paper"]
