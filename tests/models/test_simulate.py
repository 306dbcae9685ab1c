import math
import re
from dataclasses import replace

import numpy as np
import pytest

from srbval import load_bearing, load_recording, write_run
from srbval.models.estimates import StepError
from srbval.models.full_run import full_model
from srbval.models.health import assess
from srbval.models.run import RunStatus, RunSummary
from srbval.models.run_statistics import RunStatistics, load_direction
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.scene import RollerFit, paper_scene
from tests.models.test_step_error import told

ROUNDING = 1e-12  # of a sum of two frequencies
ALL = 0.01  # of the load, where the bearing alone carries it
SLOW_CAGE = 0.005  # of a cage that slows down: 0.002 between imex2's steps, 0.02 to twice the paper's
MOMENTUM_N = 1.0  # of 125 kN; the last displacements are no means
SPIN = 0.02  # of the rollers' spin in pure rolling: they slip a little

GOOD = {
    "scene": paper_scene(),
    "rolling_elements": 38,
    "status": RunStatus.OK,
    "reason": "",
    "samples": 1,
    "wall_s": 1.0,
    "compile_s": 0.0,
    "cage_ratio": 0.4314,
    "rolling_ratio": 0.4304,
    "roller_load_share": 0.05,
    "balanced_share": 0.06,
    "deepest_m": 2e-5,
    "energy_imbalance": -0.04,
}


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


@pytest.mark.parametrize(("solver", "factor"), [("ode1", 2), ("ode2", 4)])
def test_silent_failures_are_caught(solver, factor, tmp_path):
    """Rollers thrown clear, acceleration zero, no NaN: must not look like a quiet bearing, and leaves no file."""
    scene = paper_scene(duration="0.5 s", output_rate="15360 Hz", solver={"name": solver, "step_s": factor / 61_440})
    failed = simulate_to_file(scene, tmp_path / "run.h5")
    assert not failed.status.usable
    assert "--dt" in failed.reason
    assert list(tmp_path.iterdir()) == []


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
        ("imex2", TOO_COARSE, "take a step of 1/245760 s (4.0690104e-06) (--dt)"),
        ("ode4", TOO_COARSE, "take the solver imex2 (--solver), or a step of 1/245760 s (4.0690104e-06) (--dt)"),
        ("ode4", replace(TOO_COARSE, stalled=True), "steps 4 times finer have the same errors: take the solver imex2"),
    ],
)
def test_an_inaccurate_run_names_what_is_off_and_what_would_do(solver, error, advice):
    figures = {"scene": paper_scene(solver={"name": solver}), "step_s": 1 / 61440, "step_limit_s": 1e-3}
    reason = assess(RunSummary(**(GOOD | figures | {"step_error": error})))[1]
    assert f"band_rms +20 % (standard error 0 %, limit 5 %); {advice}" in reason


def test_a_run_file_opens_in_xarray_with_units(run, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    path = tmp_path / "run.h5"
    write_run(run, path)
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert all(v.attrs["units"] and v.attrs["long_name"] for v in data.variables.values())
        assert data["acceleration_x_m_s2"].dims == ("time_s",)
        np.testing.assert_array_equal(data["acceleration_x_m_s2"], run.acceleration_m_s2[:, 0])
        np.testing.assert_allclose(data["time_s"], (1 + np.arange(run.samples)) / 20480, rtol=ROUNDING)


def test_load_share_follows_the_path(run):
    assert 0.03 < run.roller_load_share < 0.1
    alone = simulate(paper_scene(duration="0.1 s", settle="0.1 s", load={"path": "bearing"}))
    assert alone.roller_load_share == pytest.approx(1.0, abs=ALL)
    assert np.isnan(simulate(paper_scene(duration="0.01 s", settle="0 s", load={"radial": "0 N"})).roller_load_share)


def test_details_add_up_to_the_force_on_the_ring(run):
    detailed = simulate(replace(run.scene, duration_s=0.02, detail_rate_hz=1024.0))
    rollers = 38
    assert detailed.spin_rad_s.shape == (21, rollers)
    assert detailed.load_n.shape == (21, 2, rollers, 3)
    # rollers turn against the shaft, by the pitch radius over their own
    assert np.median(detailed.spin_rad_s) == pytest.approx(-32.08 * 0.14181 / 0.02, rel=SPIN)
    upwards = detailed.load_n[:, 0].sum(axis=(1, 2))
    assert upwards.mean() > detailed.roller_force_n[:, 1].mean() > 0


def test_without_a_load_the_rollers_are_unloaded(tmp_path):
    scene = paper_scene(duration="0.05 s", settle="0 s", load={"radial": "0 N"})
    assert simulate_to_file(scene, tmp_path / "run.h5", step=Step.UNCHECKED).status is RunStatus.ROLLERS_UNLOADED
    assert any("the run ended rollers-unloaded" in note for note in load_recording(tmp_path / "run.h5").notes)
    pressed = replace(scene, contact=replace(scene.contact, roller_fit=RollerFit.PRINTED))
    assert simulate(pressed, step=Step.UNCHECKED).status is RunStatus.OK


SLOW = {
    "shaft_speed": "3000 rpm",
    "load": {"radial": "5 kN", "path": "bearing"},
    "duration": "0.3 s",
    "contact": {"static_friction": 0.02, "dynamic_friction": 0.02},
    "output_rate": "15360 Hz",
}


def test_a_slow_cage_is_physics_when_it_is_converged():
    """A light load at high speed, little friction: the same at half the step, and told with what it means."""
    coarse, fine = (
        simulate(paper_scene(**SLOW, solver={"step_s": 1 / 61_440 / n}), step=Step.UNCHECKED) for n in (1, 2)
    )
    assert coarse.status is fine.status is RunStatus.SKIDDING
    assert coarse.cage_ratio == pytest.approx(fine.cage_ratio, rel=SLOW_CAGE)
    assert coarse.cage_ratio < 0.92 * 0.4304
    rolling = load_bearing("skf-22240").orders.ftf
    assert f"BPFO lies {fine.cage_ratio / rolling - 1:+.1%}" in fine.reason
    assert f"BPFI {(1 - fine.cage_ratio) / (1 - rolling) - 1:+.1%} from" in fine.reason
    assert "both drift and broaden" in fine.reason
    drifting = replace(fine, step_error=told("cage", 0.001))
    assert "cage +0.1 % (standard error 0 %, limit 0.001 %), more the longer the cage's speed" in assess(drifting)[1]
    assert "more radial load, less speed" in fine.reason
    assert 'path = "bearing"' not in fine.reason


@pytest.mark.parametrize(("solver", "times"), [("imex2", 4), ("ode1", 1)])
def test_a_failed_run_of_the_same_scene_is_not_called_skidding(solver, times):
    failed = simulate(paper_scene(**SLOW, solver={"name": solver, "step_s": times / 61_440}), step=Step.UNCHECKED)
    assert not failed.status.usable
    offered = re.search(r"1/\d+ s \((\S+)\) \(--dt\)", failed.reason)
    assert offered
    assert simulate(paper_scene(**SLOW, solver={"step_s": float(offered[1])}), step=Step.UNCHECKED).status.usable
    assert ("--solver" in failed.reason) == (solver != "imex2")


@pytest.mark.parametrize("path", ["housing", "bearing"])
def test_the_rings_momentum_balances(path):
    """Mean forces on the ring, weight and spring included, make its change of momentum; explicit methods keep that."""
    scene = paper_scene(
        duration="0.1 s", load={"path": path, "gravity": True}, defect={"kind": "outer"}, solver={"name": "ode4"}
    )
    stats = RunStatistics(scene=scene, bearing=load_bearing(scene.bearing))
    for _, steps in full_model(stats, 0, scene.samples):
        stats.add(steps.out)
    load_n, interval_s = scene.load.radial_n * load_direction(scene), 1 / scene.output_rate_hz
    missing_n = stats.momentum.missing_n(load_n, interval_s)
    assert np.abs(missing_n).max() < MOMENTUM_N
    lighter = replace(stats.momentum, weight_n=0.0).missing_n(load_n, interval_s)
    assert lighter[1] - missing_n[1] == pytest.approx(stats.momentum.mass_kg * 9.80665)
