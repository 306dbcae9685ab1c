"""The equations of motion against an independent formulation, conservation laws and closed forms."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from srbval.bearing import SphericalRollerGeometry, load_bearing
from srbval.models.full.explicit_kernel import OUTPUTS, advance
from srbval.models.full.motion_kernel import CONTACT_VALUES, right_hand_side
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.start import rolling_state
from srbval.models.solvers import TABLEAUX
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
    n, half = len(model.roller_angle), len(y) // 2
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
    rate, contact = np.zeros_like(y), np.zeros(CONTACT_VALUES)
    right_hand_side(t, y, model, rate, contact)
    return rate, contact


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
    n, half = len(model.roller_angle), len(y) // 2
    y[2 * n : 2 * n + 2] = (0.004, -0.003)  # a tilted cage that tumbles
    y[half + 2 * n : half + 2 * n + 3] = (0.6, -0.4, 32.0)
    y[half : half + n] = np.linspace(-0.05, 0.05, n)
    momentum, energy = momentum_and_energy(model, y)
    out = np.zeros((60, OUTPUTS))
    tableau = TABLEAUX["ode4"]
    advance(y, 0, scene.solver.step_s / 4, 4, tableau.a, tableau.b, tableau.c, model, out)
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
    out = np.zeros((600, OUTPUTS))
    tableau = TABLEAUX["ode4"]
    advance(y, 0, scene.solver.step_s, 3, tableau.a, tableau.b, tableau.c, model, out)
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
    tableau = TABLEAUX["ode4"]
    exact[len(exact) // 2 - 3 : len(exact) // 2] = 0.0  # ring at rest in its middle: the load swings it
    start = exact.copy()
    seconds = 8e-4  # about one swing
    swing = np.sqrt(model.housing_stiffness / model.ring_mass)
    advance(exact, 0, seconds / 2048, 2048, tableau.a, tableau.b, tableau.c, model, np.zeros((1, OUTPUTS)))
    errors = []
    for steps in (48, 96):
        y, t = start.copy(), TABLEAUX[name]
        advance(y, 0, seconds / steps, steps, t.a, t.b, t.c, model, np.zeros((1, OUTPUTS)))
        wrong = y - exact
        errors.append(np.linalg.norm(np.concatenate([wrong[-3:], swing * wrong[len(y) // 2 - 3 : len(y) // 2]])))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)
