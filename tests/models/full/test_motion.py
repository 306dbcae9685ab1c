"""The equations of motion against an independent formulation, conservation laws and closed forms."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from srbval.bearing import SphericalRollerGeometry, load_bearing
from srbval.models.full.drive_kernel import external_load, shaft_motion
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.start import rolling_state
from srbval.models.full.steps import rates, take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.models.full.reference import State, contact_forces, roller_frames

ROUNDING = 1e-9  # of two formulations that subtract lengths of 0.16 m to find micrometres of penetration
CONSERVED = 1e-9  # relative drift allowed to RK4 over the free flight below


def geometry() -> SphericalRollerGeometry:
    found = load_bearing("skf-22240").geometry
    assert found is not None
    return found


def disturbed(model: Parameters, seed: int) -> np.ndarray:
    """A state near rolling with everything moving: slides, tilts, ring, spins."""
    rng = np.random.default_rng(seed)
    y = rolling_state(model)
    n, half = len(model.slot_angle), len(y) // 2
    y[:n] += rng.normal(0, 5e-6, n)
    y[2 * n : 2 * n + 2] += rng.normal(0, 2e-4, 2)
    y[2 * n + 2] += rng.uniform(0, 6)
    y[2 * n + 3 : half] += rng.normal(0, 1e-5, 3)
    y[half : half + n] += rng.normal(0, 0.02, n)
    y[half + n : half + 2 * n] += rng.normal(0, 1.0, n)
    y[half + 2 * n : half + 2 * n + 3] += rng.normal(0, 0.05, 3)
    y[-3:] += rng.normal(0, 0.01, 3)
    return y


def rates_of(model: Parameters, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = rates(model, t, y)
    return found.rate, found.contact


@pytest.mark.parametrize("kind", ["none", "outer", "inner"])
@pytest.mark.parametrize("fit", ["play", "printed"])
def test_contact_forces_agree_with_the_independent_formulation(kind: str, fit: str) -> None:
    scene = paper_scene(contact={"roller_fit": fit}, defect={"kind": kind})
    g = geometry()
    model = make_parameters(scene, g)
    y, t = disturbed(model, 7), 0.0123
    rate, contact = rates_of(model, t, y)
    expected = contact_forces(scene, g, t, y)
    state, (_, axes) = State.of(y), roller_frames(g, State.of(y))
    n, half = len(state.slide), len(y) // 2
    scale = np.abs(expected["force"]).max()
    assert scale > 100.0, "the state must press some rollers"
    assert contact[:3] == pytest.approx(expected["on_ring"], abs=ROUNDING * scale)
    # spin: I_a d(spin)/dt = torque about the roller's own axis
    spin = np.einsum("ij,ij->i", expected["torque"], axes[:, :, 2]) / model.roller_axial
    assert rate[half + n : half + 2 * n] == pytest.approx(spin, abs=ROUNDING * np.abs(spin).max())
    # slide: m u'' = m (L + u) |omega x e_x|^2 + force along the slot
    reach = model.centre_distance + state.slide
    turning = np.cross(state.omega, axes[:, :, 0])
    slide = (
        reach * (turning**2).sum(axis=1) + np.einsum("ij,ij->i", expected["force"], axes[:, :, 0]) / model.roller_mass
    )
    assert rate[half : half + n] == pytest.approx(slide, abs=ROUNDING * np.abs(slide).max())


def test_ring_hangs_on_spring_and_damper_and_is_pushed_by_the_load() -> None:
    scene = paper_scene(load={"axial": "10 kN"})
    model = make_parameters(scene, geometry())
    y = disturbed(model, 3)
    rate, contact = rates_of(model, 0.0, y)
    state = State.of(y)
    expected = (
        np.array([0.0, -124.8e3, 10e3]) + contact[:3] - 5e9 * state.ring - 5e5 * state.ring_rate
    ) / model.ring_mass
    assert rate[-3:] == pytest.approx(expected, rel=1e-9, abs=1e-6)


def momentum_and_energy(model: Parameters, y: np.ndarray) -> tuple[np.ndarray, float]:
    """Angular momentum about the bearing centre and kinetic energy of cage and rollers, world axes."""
    state, (centres, axes) = State.of(y), roller_frames(geometry(), State.of(y))
    momentum, energy = np.zeros(3), 0.0
    cage = roller_frames_axis(state)
    inertia = model.cage_transverse * np.eye(3) + (model.cage_axial - model.cage_transverse) * np.outer(cage, cage)
    momentum += inertia @ state.omega
    energy += 0.5 * state.omega @ inertia @ state.omega
    for j, (centre, axis) in enumerate(zip(centres, axes, strict=True)):
        z = axis[:, 2]
        velocity = np.cross(state.omega, centre) + state.slide_rate[j] * axis[:, 0]
        across = state.omega - (state.omega @ z) * z
        own = model.roller_transverse * across + model.roller_axial * state.spin[j] * z
        momentum += model.roller_mass * np.cross(centre, velocity) + own
        energy += 0.5 * model.roller_mass * velocity @ velocity + 0.5 * (across + state.spin[j] * z) @ own
    return momentum, energy


def roller_frames_axis(state: State) -> np.ndarray:
    """Axis of the cage in world axes."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("XYZ", state.cage).as_matrix()[:, 2]


def test_free_flight_conserves_angular_momentum_and_energy() -> None:
    """No contact: whatever cage and rollers do, inertia terms must neither make nor lose momentum or energy.

    A wrong sign in the centrifugal, Coriolis or gyroscopic terms fails here.
    """
    scene = paper_scene(contact={"radial_play": "3 mm"})
    model = make_parameters(scene, geometry())
    y = disturbed(model, 11)
    n, half = len(model.slot_angle), len(y) // 2
    y[2 * n : 2 * n + 2] = (0.004, -0.003)  # a tilted cage that tumbles
    y[half + 2 * n : half + 2 * n + 3] = (0.6, -0.4, 32.0)
    y[half : half + n] = np.linspace(-0.05, 0.05, n)
    momentum, energy = momentum_and_energy(model, y)
    out = take_steps(model, y, METHODS["ode4"], step_s=scene.solver.step_s / 4, intervals=60, steps_per_output=4).out
    assert out[:, 12].max() < 0, "nothing may touch"
    after, energy_after = momentum_and_energy(model, y)
    assert after == pytest.approx(momentum, abs=CONSERVED * float(np.linalg.norm(momentum)))
    assert energy_after == pytest.approx(energy, rel=CONSERVED)


def test_looking_only_at_near_rollers_loses_nothing() -> None:
    """Rollers that are passed over as too far from a race carry no force in the independent formulation."""
    scene = paper_scene()
    g = geometry()
    model = make_parameters(scene, g)
    y = rolling_state(model)
    take_steps(model, y, METHODS["ode4"], step_s=scene.solver.step_s, intervals=1800)
    t = 1800 * scene.solver.step_s
    expected = contact_forces(scene, g, t, y)["on_ring"]
    assert rates_of(model, t, y)[1][:3] == pytest.approx(expected, abs=1e-8 * float(np.linalg.norm(expected)))


def test_jitted_equals_plain_python() -> None:
    code = (
        "import json, numpy as np; from tests.models.full.test_motion import *;"
        "m = make_parameters(paper_scene(defect={'kind': 'inner'}), geometry());"
        "r, c = rates_of(m, 0.01, disturbed(m, 5)); print(json.dumps([list(r), list(c)]))"
    )
    env = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    text = subprocess.run([sys.executable, "-c", code], env=env, check=True, capture_output=True, text=True).stdout
    plain_rate, plain_contact = map(np.array, json.loads(text))
    model = make_parameters(paper_scene(defect={"kind": "inner"}), geometry())
    rate, contact = rates_of(model, 0.01, disturbed(model, 5))
    assert rate == pytest.approx(plain_rate, rel=1e-9, abs=1e-12 * np.abs(plain_rate).max())
    assert contact == pytest.approx(plain_contact, rel=1e-9, abs=1e-12 * np.abs(plain_contact).max())


@pytest.mark.parametrize(("name", "order"), [("ode1", 1), ("ode2", 2), ("ode3", 3), ("ode4", 4)])
def test_observed_order_of_the_methods(name: str, order: int) -> None:
    """Free outer ring on its housing: halving the step divides the error by two to the order."""
    scene = paper_scene(contact={"radial_play": "3 mm"}, housing={"damping": "5e4 Ns/m"})
    model = make_parameters(scene, geometry())
    exact = rolling_state(model)
    exact[len(exact) // 2 - 3 : len(exact) // 2] = 0.0  # ring at rest in its middle: the load swings it
    start = exact.copy()
    seconds = 8e-4  # about one swing
    swing = np.sqrt(model.housing_stiffness / model.ring_mass)
    take_steps(model, exact, METHODS["ode4"], step_s=seconds / 2048, intervals=2048)
    errors = []
    for steps in (48, 96):
        y = start.copy()
        take_steps(model, y, METHODS[name], step_s=seconds / steps, intervals=steps)
        wrong = y - exact
        errors.append(np.linalg.norm(np.concatenate([wrong[-3:], swing * wrong[len(y) // 2 - 3 : len(y) // 2]])))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)


def test_a_bump_on_a_roller_presses_like_a_thicker_roller() -> None:
    """A bump all round one roller at its middle circle adds its height to the penetration there, and nowhere else."""
    height = 1e-5
    bump = {"kind": "roller", "height": "0.01 mm", "extent": "0.05 m", "roller": 4, "row": 2, "angle": "0 deg"}
    scene = paper_scene(contact={"roller_fit": "printed"})
    g = geometry()
    plain = make_parameters(scene, g)
    y = rolling_state(plain)
    third = bump | {"extent": "0.0418 m"}
    ringed = make_parameters(
        paper_scene(
            contact={"roller_fit": "printed"},
            defect=third,
            further_defects=[third | {"angle": "120 deg"}, third | {"angle": "240 deg"}],
        ),
        g,
    )
    before, after = rates(plain, 0.0, y).load_n, rates(ringed, 0.0, y).load_n
    changed = np.argwhere(np.abs(after - before) > 1e-6 * before.max())
    assert {tuple(c) for c in changed} <= {(0, 22, 1), (1, 22, 1)}, "roller 4 of row 2, middle circle, both races"
    touching = after[:, 22, 1] > 0
    assert touching.any()
    # each touching point is pressed deeper by the height; one or two points touch
    extra = (after - before)[:, 22, 1] / (plain.law.stiffness * height)
    assert np.all(np.isclose(extra[touching], np.round(extra[touching]), atol=0.02))


def test_the_shaft_follows_its_profile() -> None:
    """Trapezoids: the angle is the integral of the speed; the recorded time starts after settling."""
    scene = paper_scene(
        speed_profile={"time": ["0 s", "1 s", "3 s"], "speed": ["10 rad/s", "30 rad/s", "20 rad/s"]},
        duration="3 s", settle="0.5 s",
    )  # fmt: skip
    drive = make_parameters(scene, geometry()).drive
    assert shaft_motion(0.25, drive) == pytest.approx((10.0, 2.5))
    assert shaft_motion(1.0, drive) == pytest.approx((20.0, 5.0 + 7.5))
    assert shaft_motion(1.5, drive) == pytest.approx((30.0, 5.0 + 20.0))
    assert shaft_motion(3.5, drive) == pytest.approx((20.0, 5.0 + 20.0 + 50.0))
    assert scene.mean_shaft_rad_s == pytest.approx((20.0 + 50.0) / 3)


def test_the_load_follows_its_profile() -> None:
    scene = paper_scene(
        load_profile={"time": ["0 s", "2 s"], "radial": ["0 N", "100 kN"], "axial": ["10 kN", "0 N"]},
        duration="2 s", settle="0 s",
    )  # fmt: skip
    drive = make_parameters(scene, geometry()).drive
    assert external_load(0.5, drive) == pytest.approx((25e3, 7.5e3))
    assert external_load(9.0, drive) == pytest.approx((100e3, 0.0))
    assert scene.mean_radial_n == pytest.approx(50e3)


def test_gravity_pulls_down_on_everything() -> None:
    """Free flight: every slide and the ring fall with the component of g along their direction."""
    scene = paper_scene(contact={"radial_play": "3 mm"}, load={"gravity": True, "radial": "0 N"})
    model, without = (
        make_parameters(s, geometry())
        for s in (scene, paper_scene(contact={"radial_play": "3 mm"}, load={"radial": "0 N"}))
    )
    y = rolling_state(without)
    difference = rates(model, 0.0, y).rate - rates(without, 0.0, y).rate
    half, n = len(y) // 2, 38
    assert difference[-3:] == pytest.approx([0.0, -9.80665, 0.0])
    up = roller_frames(geometry(), State.of(y))[1][:, 1, 0]
    assert difference[half : half + n] == pytest.approx(-9.80665 * up, abs=1e-9)
