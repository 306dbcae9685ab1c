"""Runs: what they record, how they end and what is said of it; the estimated error of their step."""

import json
import math
import re
from dataclasses import replace

import h5py
import numpy as np
import pytest

from srbval import load_bearing, load_recording
from srbval.models import step_error as errors
from srbval.models.estimates import BLOCKS, ERROR_TOLERANCE, Estimate, StepError
from srbval.models.full_run import run_full
from srbval.models.health import assess
from srbval.models.run import RunStatus, RunSummary
from srbval.models.run_statistics import RunStatistics, load_direction
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.scene import RollerFit, Scene, SpeedProfile, load_scene, paper_scene

RMS = "RMS in 500-1500 Hz"
BEARING = load_bearing("skf-22240")
RPM = 2 * math.pi / 60


def fast_rig(steps_per_s: int, rpm: float = 3000.0, seconds: float = 0.25) -> Scene:
    """The drilled rig scene so fast that the hole passes in a few steps, damped so that its ring does not ring on."""
    changes = {"defect": {"kind": "outer"}, "housing": {"damping": "5e5 Ns/m"}, "solver": {"step_s": 1 / steps_per_s}}
    return load_scene("rig", changes | {"shaft_speed_rad_s": rpm * RPM, "duration_s": seconds})


def difference(name: str, first: np.ndarray, second: np.ndarray) -> Estimate:
    """Of two records of samples."""
    (found,) = errors.estimate_errors(*({name: record.reshape(BLOCKS, -1).mean(axis=1)} for record in (first, second)))
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
    found = [difference(errors.CAGE_QUANTITY, *(10 + draw.standard_normal((2, 800)))) for _ in range(300)]
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
    (found,) = errors.estimate_errors(*({RMS: np.array(squares)} for squares in blocks))
    assert found.certainly_exceeds() is certain
    assert found.certainly_exceeds() or found.undecided


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
    """An error beyond one standard error asks for a finer step; beyond 2.4 of them it is a verdict."""
    for sign in (1, -1):
        estimate = Estimate(kind="band_rms", of="RMS", error=sign * error, scatter=scatter)
        assert (estimate.exceeds_tolerance, estimate.undecided) == (beyond, open_)
        assert estimate.certainly_exceeds() == (beyond and not open_)


def test_the_estimate_is_the_error_against_a_finer_run():
    """The fast rig at a long step: sign and size of the estimate against a run with a quarter of it.

    The method is of order two: a sixteenth of the error is left there, within the room for it.
    """
    scene = fast_rig(40960, rpm=4000.0)
    estimated = {e.of: e for e in errors.step_error(scene, BEARING).estimates}
    finer = replace(scene, solver=replace(scene.solver, step_s=1 / 163840))
    run, right = (errors.block_means(s.output_rate_hz, simulate(s, step=Step.UNCHECKED).out) for s in (scene, finer))
    for true in errors.estimate_errors(run, right):
        name, estimate = true.of, estimated[true.of]
        room = 3 * math.hypot(true.scatter, estimate.scatter) + 0.3 * ERROR_TOLERANCE[estimate.kind]
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
    chosen, error = errors.with_chosen_step(scene, BEARING)
    times = scene.solver.step_s / chosen.solver.step_s
    assert times == pytest.approx(round(times))
    assert 2 <= times <= errors.MAX_REFINEMENT * (1 + 1e-9)
    assert error.step_s == pytest.approx(chosen.solver.step_s)
    # Euler's steps leave a twentieth of the losses without a source at any step; bands are beyond by chance or not.
    assert (error.needs_finer_steps or abs(error.energy) > ERROR_TOLERANCE["drive_power"]) is not enough


def test_the_chosen_step_of_the_papers_scene_is_known_to_be_fine_enough():
    """In 0.15 s the scatter of rattling rollers hides errors of 5 %; the piece of this run is twice as long."""
    _, error = errors.with_chosen_step(paper_scene(duration="0.3 s"), BEARING)
    assert error.certain_excesses + error.undecided_estimates == ()


def test_a_profile_is_checked_at_its_highest_speed():
    steady = fast_rig(40960, rpm=2000.0)
    ramp = SpeedProfile(time_s=(0.0, 1.0), speed_rad_s=(10.0, 2000 * RPM))
    assert errors.step_error(replace(steady, speed_profile=ramp), BEARING) == errors.step_error(steady, BEARING)


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
    assert abs(numerics["band_rms_pct"]) > 100 * ERROR_TOLERANCE["band_rms"]


ALL = 0.01  # of the load, where the bearing alone carries it
SLOW_CAGE = 0.005  # of a cage that slows down: 0.002 between imex2's steps, 0.02 to twice the paper's
MOMENTUM_N = 1.0  # of 125 kN; the last displacements are no means
SPIN = 0.02  # of the rollers' spin in pure rolling: they slip a little
GOOD = {"scene": paper_scene(), "rolling_elements": 38, "status": RunStatus.OK, "reason": "", "samples": 1}
GOOD |= {"wall_s": 1.0, "compile_s": 0.0, "cage_ratio": 0.4314, "rolling_ratio": 0.4304}
GOOD |= {"roller_load_share": 0.05, "balanced_share": 0.06, "deepest_m": 2e-5, "energy_imbalance": -0.04}
TOO_COARSE, DRIVE = told("band_rms", 0.2), "drive_power"
# Without another path all of the load must be carried; in a speed ramp an open energy balance is a caution. Beside the
# weight of the ring and its housing a load of 20 N is next to nothing, and what of it is missing too.
CARRIED = {"scene": paper_scene(load={"path": "bearing"}), "roller_load_share": 0.98, "balanced_share": 1.0}
RAMP = paper_scene(speed_profile={"time_s": [0.0, 1.0], "speed_rad_s": [30.0, 60.0]}, duration="1 s")
LIGHT, WEIGHTLESS = (
    {"scene": paper_scene(load={"radial": "20 N", "gravity": weight}), "missing_n": 9.0, "energy_imbalance": 0.01}
    for weight in (True, False)
)


@pytest.fixture(scope="module")
def run():
    return simulate(paper_scene(duration="0.3 s", defect={"kind": "outer"}), step=Step.UNCHECKED)


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({"finite": False}, RunStatus.NOT_FINITE),
        ({"deepest_m": 1e-3}, RunStatus.TOO_DEEP),
        ({"cage_ratio": 0.42}, RunStatus.SKIDDING),
        ({"cage_ratio": 0.45}, RunStatus.SKIDDING),
        ({"cage_ratio": 0.42, "energy_imbalance": -0.08}, RunStatus.CAGE_LOST),
        ({"cage_ratio": 0.42, "energy_imbalance": -0.08, "step_s": 1e-5, "step_limit_s": 3e-5}, RunStatus.SKIDDING),
        ({"cage_ratio": 0.42, "step_s": 1.2e-5, "step_limit_s": 1e-5}, RunStatus.CAGE_LOST),
        ({"cage_ratio": 0.42, "idle_share": 0.9, "balanced_share": 0.0}, RunStatus.CAGE_LOST),
        ({"missing_n": 0.21 * 124.8e3}, RunStatus.LOAD_LOST),
        ({"balanced_share": 0.009}, RunStatus.ROLLERS_UNLOADED),
        ({"roller_load_share": 0.029, "energy_imbalance": -0.17}, RunStatus.LOAD_LOST),
        ({"roller_load_share": 0.0, "idle_share": 0.9}, RunStatus.LOAD_LOST),
        ({"roller_load_share": 0.029, "energy_imbalance": 0.09}, RunStatus.ROLLERS_UNLOADED),
        ({"energy_imbalance": -0.11}, RunStatus.ENERGY_OPEN),
        ({"energy_imbalance": -0.11, "step_error": StepError(step_s=1e-5, estimates=())}, RunStatus.OK),
        ({"energy_imbalance": -0.47, "step_error": told(DRIVE, 0.0, energy=-0.01)}, RunStatus.OK),
        ({"energy_imbalance": -0.47, "step_error": told(DRIVE, 0.0, energy=-0.21)}, RunStatus.ENERGY_OPEN),
        ({"energy_imbalance": -0.93, "step_error": told(DRIVE, 0.9, energy=-0.01)}, RunStatus.ENERGY_OPEN),
        ({"cage_ratio": 0.42, "step_error": told("cage", 0.005, 1e-3)}, RunStatus.SKIDDING),
        ({"cage_ratio": 0.42, "step_error": told("cage", 0.02, 1e-3)}, RunStatus.INACCURATE),
        ({"cage_ratio": 0.42, "step_error": told("cage", 0.02, 5e-3)}, RunStatus.SKIDDING),
        ({"step_s": 1.2e-5, "step_limit_s": 1e-5}, RunStatus.STEP_TOO_LONG),
        ({"step_s": 1.0, "step_limit_s": math.inf}, RunStatus.OK),
        ({}, RunStatus.OK),
        ({"step_error": TOO_COARSE}, RunStatus.INACCURATE),
        ({"step_error": TOO_COARSE, "finite": False}, RunStatus.NOT_FINITE),
        (CARRIED | {"energy_imbalance": -0.17}, RunStatus.LOAD_LOST),
        (CARRIED | {"energy_imbalance": 0.01}, RunStatus.OK),
        ({"scene": RAMP, "energy_imbalance": 0.95}, RunStatus.OK),
        (LIGHT, RunStatus.OK),
        (WEIGHTLESS, RunStatus.LOAD_LOST),
    ],
)
def test_health(changes, status):
    found, reason = assess(RunSummary(**(GOOD | changes)))
    assert found is status
    assert "scene" not in changes or ("caution" in reason) == (changes["scene"] is RAMP)


@pytest.mark.parametrize(
    ("solver", "error", "advice"),
    [
        ("imex2", TOO_COARSE, "take a step of 1/245760 s (4.0690104e-06)"),
        ("ode4", TOO_COARSE, "take the solver imex2, or a step of 1/245760 s (4.0690104e-06)"),
        ("ode4", replace(TOO_COARSE, stalled=True), "steps 4 times finer have the same errors: take the solver imex2"),
    ],
)
def test_an_inaccurate_run_names_what_is_off_and_what_would_do(solver, error, advice):
    figures = {"scene": paper_scene(solver={"name": solver}), "step_s": 1 / 61440, "step_limit_s": 1e-3}
    reason = assess(RunSummary(**(GOOD | figures | {"step_error": error})))[1]
    assert f"band_rms +20 % (standard error 0 %, limit 5 %); {advice}" in reason


def test_load_share_follows_the_path(run):
    assert 0.03 < run.roller_load_share < 0.1
    alone = simulate(paper_scene(duration="0.1 s", settle="0.1 s", load={"path": "bearing"}), step=Step.UNCHECKED)
    assert alone.roller_load_share == pytest.approx(1.0, abs=ALL)


def test_details_add_up_to_the_force_on_the_ring(run):
    detailed = simulate(replace(run.scene, duration_s=0.02, detail_rate_hz=1024.0), step=Step.UNCHECKED)
    rollers = 38
    assert detailed.spin_rad_s.shape == (21, rollers)
    assert detailed.load_n.shape == (21, 2, rollers, 3)
    # rollers turn against the shaft, by the pitch radius over their own
    assert np.median(detailed.spin_rad_s) == pytest.approx(-32.08 * 0.14181 / 0.02, rel=SPIN)
    upwards = detailed.load_n[:, 0].sum(axis=(1, 2))
    assert upwards.mean() > detailed.roller_force_n[:, 1].mean() > 0


def test_without_a_load_the_rollers_are_unloaded(tmp_path):
    scene = paper_scene(duration="0.05 s", settle="0 s", load={"radial": "0 N"})
    run = simulate_to_file(scene, tmp_path / "run.h5", step=Step.UNCHECKED)
    assert run.status is RunStatus.ROLLERS_UNLOADED
    assert np.isnan(run.roller_load_share)
    assert any("the run ended rollers-unloaded" in note for note in load_recording(tmp_path / "run.h5").notes)
    pressed = replace(scene, contact=replace(scene.contact, roller_fit=RollerFit.PRINTED))
    assert simulate(pressed, step=Step.UNCHECKED).status is RunStatus.OK


SLOW = {"shaft_speed": "3000 rpm", "load": {"radial": "5 kN", "path": "bearing"}, "duration": "0.3 s"}
SLOW |= {"contact": {"static_friction": 0.02, "dynamic_friction": 0.02}, "output_rate": "15360 Hz"}
QUIET = {"duration": "0.5 s", "output_rate": "15360 Hz"}


def test_a_slow_cage_is_physics_when_it_is_converged():
    """A light load at high speed, little friction: the same at half the step, and told with what it means."""
    steps = ({"step_s": 1 / 61_440 / n} for n in (1, 2))
    coarse, fine = (simulate(paper_scene(**SLOW, solver=one), step=Step.UNCHECKED) for one in steps)
    assert coarse.status is fine.status is RunStatus.SKIDDING
    assert coarse.cage_ratio == pytest.approx(fine.cage_ratio, rel=SLOW_CAGE)
    assert coarse.cage_ratio < 0.92 * 0.4304
    rolling = load_bearing("skf-22240").orders.ftf
    assert f"BPFO lies {fine.cage_ratio / rolling - 1:+.1%}" in fine.reason
    assert f"BPFI {(1 - fine.cage_ratio) / (1 - rolling) - 1:+.1%} from" in fine.reason
    assert "both broaden" in fine.reason
    drifting = replace(fine, step_error=told("cage", 0.001))
    assert "cage +0.1 % (standard error 0 %, limit 0.001 %)" in assess(drifting)[1]
    assert "more radial load, less speed" in fine.reason
    assert 'path = "bearing"' not in fine.reason


@pytest.mark.parametrize(
    ("changes", "solver", "times"), [(SLOW, "imex2", 4), (SLOW, "ode1", 1), (QUIET, "ode1", 2), (QUIET, "ode2", 4)]
)
def test_a_failed_run_has_no_file_and_an_advice_that_helps(changes, solver, times, tmp_path):
    """It is not called skidding, nor a quiet bearing: rollers thrown clear leave an acceleration of zero."""
    scene = paper_scene(**changes, solver={"name": solver, "step_s": times / 61_440})
    failed = simulate_to_file(scene, tmp_path / "run.h5", step=Step.UNCHECKED)
    assert not failed.status.usable
    assert list(tmp_path.iterdir()) == []
    offered = re.search(r"a step of 1/\d+ s \((\S+)\)", failed.reason)
    assert offered
    assert simulate(paper_scene(**changes, solver={"step_s": float(offered[1])}), step=Step.UNCHECKED).status.usable
    assert ("take the solver" in failed.reason) == (solver != "imex2")


@pytest.mark.parametrize("path", ["housing", "bearing"])
def test_the_rings_momentum_balances(path):
    """Mean forces on the ring, weight and spring included, make its change of momentum; explicit methods keep that."""
    load = {"path": path, "gravity": True}
    scene = paper_scene(duration="0.1 s", load=load, defect={"kind": "outer"}, solver={"name": "ode4"})
    stats = RunStatistics(scene=scene, bearing=load_bearing(scene.bearing))
    for _, steps in run_full(stats, 0, scene.samples):
        stats.add(steps.out)
    load_n, interval_s = scene.load.radial_n * load_direction(scene), 1 / scene.output_rate_hz
    missing_n = stats.sums.missing_n(stats.ring, load_n, interval_s)
    assert np.abs(missing_n).max() < MOMENTUM_N
    lighter = stats.sums.missing_n(stats.ring._replace(weight_n=0.0), load_n, interval_s)
    assert lighter[1] - missing_n[1] == pytest.approx(stats.ring.mass_kg * 9.80665)
