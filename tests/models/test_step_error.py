"""The estimated error of a step, against samples of known means and against runs with finer steps."""

import json
import math
from dataclasses import replace
from unittest import mock

import h5py
import numpy as np
import pytest

from srbval import RunStatus, load_bearing
from srbval.models import full_run
from srbval.models.estimates import BLOCKS, FINER, TOLERANCE, Estimate, StepError
from srbval.models.full.steps import take_steps
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.models.step_error import CAGE, LONGEST_S, MOST_FINER, block_means, differences, step_error, with_chosen_step
from srbval.scene import Scene, SpeedProfile, load_scene, paper_scene

STEPS_HZ = 61440.0
RMS = "RMS in 500-1500 Hz"
BEARING = load_bearing("skf-22240")
RPM = 2 * math.pi / 60


def fast_rig(steps_per_s: int, rpm: float = 3000.0, seconds: float = 0.25) -> Scene:
    """The drilled rig scene so fast that the hole passes in a few steps, damped so that its ring does not ring on."""
    changes = {"defect": {"kind": "outer"}, "housing": {"damping": "5e5 Ns/m"}, "solver": {"step_s": 1 / steps_per_s}}
    return load_scene("rig", changes | {"shaft_speed_rad_s": rpm * RPM, "duration_s": seconds})


def difference(name: str, first: np.ndarray, second: np.ndarray) -> Estimate:
    """Of two records of samples."""
    (found,) = differences(*({name: record.reshape(BLOCKS, -1).mean(axis=1)} for record in (first, second)))
    return found


def told(kind: str, error: float, scatter: float = 0.0, energy: float = math.nan) -> StepError:
    estimate = Estimate(kind=kind, of=kind, error=error, scatter=scatter)
    return StepError(step_s=1e-5, estimates=(estimate,), energy=energy)


def test_a_louder_record_is_off_upwards_and_noise_of_rounding_is_no_level():
    """Rollers that touch nothing leave 1e-11 m/s2, a finer step half of that; what a sensor shows counts in full."""
    squares = np.random.default_rng(1).standard_normal(4000) ** 2
    for rms, times, error in ((1.0, 1.21, 0.1), (1e-2, 4.0, 1.0), (1e-11, 4.0, 0.0)):
        found = difference(RMS, times * squares * rms**2, squares * rms**2)
        assert found.error == pytest.approx(error, rel=1e-3, abs=1e-9)
    assert difference(RMS, 1.21 * squares, squares).scatter == pytest.approx(0.0, abs=1e-9), "in every block the same"


def test_the_scatter_is_that_of_the_means():
    """Two records of independent noise: sd of the ratio of their means, over many draws and as each draw tells it."""
    draw = np.random.default_rng(2)
    found = [difference(CAGE, *(10 + draw.standard_normal((2, 800)))) for _ in range(300)]
    spread = np.std([f.error for f in found])
    assert spread == pytest.approx(math.sqrt(2 / 800) / 10, rel=0.15)
    told = np.sqrt(np.mean([f.scatter**2 for f in found]))
    assert 1.0 <= told / spread < 1.6, "the larger of what two partitions say: on the safe side"


# Squares of a band's blocks of pairs of runs, of cages that slide, at 5490 and 3449 rpm: one knock carries the band.
KNOCKS = [0.065, 2e-4, 6e-5, 5e-5, 2e-3, 2e-5, 2e-4, 0.42], [0.26, 2e-5, 1e-3, 8e-5, 2e-5, 2e-5, 4e-6, 0.86]
LOUDER = [23.0, 0.011, 0.008, 0.0076, 0.0064, 0.38, 1.17, 0.5], [0.012, 2.5e-5, 3e-4, 2.6e-4, 2e-4, 3e-4, 4e-5, 0.073]


@pytest.mark.parametrize(("blocks", "certain"), [(KNOCKS, False), (LOUDER, True)])
def test_two_knocks_prove_no_error_of_the_step_but_the_level_between_them_does(blocks, certain):
    """By their means the first are 34 % apart, 2.8 standard errors, the others 1600 %, less than one."""
    (found,) = differences(*({RMS: np.array(squares)} for squares in blocks))
    assert found.certainly_beyond() is certain
    assert found.certainly_beyond() or found.open


@pytest.mark.parametrize(
    ("error", "scatter", "beyond", "open_"),
    [
        (0.03, 0.01, False, False),
        (0.03, 0.03, False, True),
        (0.10, 0.01, True, False),
        (0.06, 0.02, False, True),
        (0.10, 0.04, True, True),
        (0.045, 0.0, False, True),
    ],
)
def test_beyond_open_or_neither(error, scatter, beyond, open_):
    for sign in (1, -1):
        estimate = Estimate(kind="band_rms", of="RMS", error=sign * error, scatter=scatter)
        assert (estimate.beyond, estimate.open) == (beyond, open_)
        assert estimate.certainly_beyond() == (beyond and not open_), (
            "by one standard error a finer step, by 2.4 a verdict"
        )


def test_two_pairs_of_steps_are_weighed_by_their_variances():
    """Chance at the finer pair is overruled by the coarser one; what is certain is not."""
    coarse, fine = told("band_rms", 0.08, 0.08), told("band_rms", 0.16, 0.08)
    (both,) = fine.with_coarser(coarse).estimates
    carried = math.hypot(0.02, 0.01)
    share = carried**2 / (carried**2 + 0.08**2)
    assert both.error == pytest.approx(share * 0.16 + (1 - share) * 0.02)
    assert both.scatter == pytest.approx(carried * 0.08 / math.hypot(carried, 0.08))
    (certain,) = told("band_rms", 0.16, 0.001).with_coarser(coarse).estimates
    assert certain.error == pytest.approx(0.16, rel=0.01)
    assert told("cage", 0.1, 0.1).with_coarser(coarse) == told("cage", 0.1, 0.1), "another quantity"


def test_the_estimate_is_the_error_against_a_finer_run():
    """The fast rig at a long step: sign and size of the estimate against a run with a quarter of it.

    The method is of order two: a sixteenth of the error is left there, within the room for it.
    """
    scene = fast_rig(40960, rpm=4000.0)
    estimated = {e.of: e for e in step_error(scene, BEARING).estimates}
    finer = replace(scene, solver=replace(scene.solver, step_s=1 / 163840))
    run, right = (
        block_means(s.output_rate_hz, r.cage_rad_s, r.acceleration_m_s2, r.energy.drive_w)
        for s, r in ((s, simulate(s, step=Step.UNCHECKED)) for s in (scene, finer))
    )
    for true in differences(run, right):
        name, estimate = true.of, estimated[true.of]
        room = 3 * math.hypot(true.scatter, estimate.scatter) + 0.3 * TOLERANCE[estimate.kind]
        assert abs(estimate.error - true.error) < max(room, 0.5 * abs(true.error)), name
    assert any(abs(e.error) > 2 * e.scatter for e in estimated.values()), "something to tell"


@pytest.mark.parametrize(
    ("scene", "enough"),
    [
        (fast_rig(20480, rpm=4000.0), True),
        (paper_scene(solver={"name": "ode1"}, duration="0.1 s", settle="0 s"), False),
    ],
    ids=["rig", "Euler's friction chatters at any step that is tried"],
)
def test_a_chosen_step_is_legal_and_costs_at_most_eight_times_the_scenes(scene, enough):
    chosen, error = with_chosen_step(scene, BEARING)
    times = scene.solver.step_s / chosen.solver.step_s
    assert times == pytest.approx(round(times))
    assert 2 <= times <= MOST_FINER * (1 + 1e-9)
    assert error.step_s == pytest.approx(chosen.solver.step_s)
    # Euler's steps leave a twentieth of the losses without a source at any step; bands are beyond by chance or not.
    assert (error.beyond or abs(error.energy) > TOLERANCE["drive_power"]) is not enough


def test_what_a_model_leaves_out_is_no_error_of_the_step():
    """Patches miss the power of couples within them, the more the faster; the same with an eighth of the step."""
    changes = {"shaft_speed_rad_s": 6469 * RPM, "load": {"radial_n": 25.1e3}, "model": "line", "duration_s": 0.1}
    run = simulate(load_scene("rig", changes | {"bodies": {"cages": 1}}))
    assert abs(run.energy_imbalance) > 0.4
    assert run.step_error is not None
    assert abs(run.step_error.energy) < 0.01
    assert run.status is RunStatus.OK


def test_a_profile_is_checked_at_its_highest_speed():
    steady = fast_rig(40960, rpm=2000.0)
    ramp = SpeedProfile(time_s=(0.0, 1.0), speed_rad_s=(10.0, 2000 * RPM))
    assert step_error(replace(steady, speed_profile=ramp), BEARING) == step_error(steady, BEARING)


@pytest.mark.parametrize(("rate_hz", "rpm"), [(1.0, 200.0), (61.0, 200.0), (1.0, 2.0)])
def test_the_check_costs_the_same_at_any_output_rate(rate_hz, rpm):
    """Steps of both pieces, counted: as many at 1 Hz, where an output interval is longer than a piece, as at 500 Hz."""

    def check(rate_hz: float) -> tuple[StepError, list[int]]:
        changes = {"solver": {"step_s": 1 / (rate_hz * round(STEPS_HZ / rate_hz))}, "shaft_speed": f"{rpm:g} rpm"}
        scene = paper_scene(model="line", duration="5 s", settle="0 s", output_rate_hz=rate_hz, **changes)
        with mock.patch.object(full_run, "take_steps", wraps=take_steps) as counted:
            error = step_error(scene, BEARING)
        _, *pieces = (call.kwargs for call in counted.call_args_list)
        return error, [len(piece["intervals"]) * piece["steps_per_output"] for piece in pieces]

    (coarse, steps), (fine, usual) = check(rate_hz), check(500.0)
    assert steps == pytest.approx(usual, rel=0.2)
    assert sum(steps) <= 1.1 * (1 + FINER) * LONGEST_S * STEPS_HZ
    assert [e.of for e in coarse.estimates] == [CAGE, "drive power"], "bands that the output does not show"
    assert coarse.estimates[0].error == pytest.approx(fine.estimates[0].error, abs=1e-4)


def test_a_step_by_hand_that_is_too_long_is_kept_and_told(tmp_path):
    path = tmp_path / "run.h5"
    scene = fast_rig(40960, rpm=4000.0, seconds=0.2)
    summary = simulate_to_file(scene, path)
    assert summary.status is RunStatus.INACCURATE
    assert summary.scene == scene
    assert "RMS" in summary.reason
    with h5py.File(path) as file:
        numerics = json.loads(file.attrs["numerics"])
        assert file.attrs["status"] == "inaccurate"
    assert abs(numerics["band_rms_pct"]) > 100 * TOLERANCE["band_rms"]
