"""Solvers: runs taken in pieces, step limits of linear theory, of one roller and of the whole bearing."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from srbval import load_scene, paper_scene
from srbval.arrays import FloatArray
from srbval.models import step_limits
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.rates import rates
from srbval.models.solvers import METHODS, Method
from srbval.processes.machine import one_thread
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, full_run, parameters

PER_OUTPUT = 2


def damaged() -> Parameters:
    """A damaged roller, whose contacts know its angle about its axis, in working space of its own."""
    defect = {"kind": "roller", "extent": "6 mm", "height": "0.04 mm"}
    return parameters(paper_scene(contact=PRINTED_FIT, defect=defect))


@pytest.mark.parametrize("name", METHODS)
def test_a_run_in_pieces_is_bit_identical(name):
    """Also where details are read in between, and where another model's working space takes over."""
    model = damaged()
    start = equilibrium_state(model)
    whole, pieces, found = start.copy(), start.copy(), []
    run = partial(full_run, method=METHODS[name], step_s=PAPER_STEP_S, steps=PER_OUTPUT)
    at_once, one = run(model, whole).advance(0, 14).out, run(model, pieces)
    for first, intervals in ((0, 6), (6, 3), (9, 5)):
        fresh = damaged()
        rates(fresh, 0.0, start)
        found.append(replace(one, model=fresh).advance(first, intervals, 3).out)
    assert np.array_equal(np.concatenate(found), at_once)
    assert np.array_equal(pieces, whole)
    without = start.copy()
    for first in range(14):
        run(model, without).advance(first, 1)
    assert np.array_equal(without, whole) == (not METHODS[name].ahead), "the memory is of consequence"


OMEGA = 3e4  # rad/s, that of a loaded roller
# Limits are bisected from rays of 0.005 and octaves of steps: ten halvings leave less than this.
FOUND = 1e-3
# Largest real and imaginary z with |R(z)| <= 1 (Hairer & Wanner 1996, sect. IV.2; Kutta's classical method: 2.785 and
# 2 sqrt 2); Euler's and Heun's methods hold no undamped oscillation.
DECAY_LIMITS = {"ode1": 2.0, "ode2": 2.0, "ode3": 2.512745, "ode4": 2.785293}
OSCILLATION_LIMITS = {"ode3": np.sqrt(3), "ode4": np.sqrt(8)}


@pytest.mark.parametrize(("direction", "limits"), [(-1 + 0j, DECAY_LIMITS), (-1e-7 + 1j, OSCILLATION_LIMITS)])
def test_longest_steps_of_explicit_methods(direction, limits):
    eigenvalue = OMEGA * direction
    for name, limit in limits.items():
        own = np.array([[eigenvalue.real, eigenvalue.imag], [-eigenvalue.imag, eigenvalue.real]])
        system = step_limits.LinearSystem(motion=np.zeros((0, 2)), stiffness=np.zeros((2, 0)), damping=own)
        found = step_limits.longest_step(METHODS[name], system)
        assert found == pytest.approx(limit / OMEGA, rel=FOUND), name


@pytest.mark.parametrize("name", ["imex1", "imex2"])
def test_leapfrog_is_stable_to_two_over_the_frequency(name):
    one = np.ones((1, 1))
    oscillator = step_limits.LinearSystem(motion=one, stiffness=-(OMEGA**2) * one, damping=0 * one)
    assert step_limits.longest_step(METHODS[name], oscillator) == pytest.approx(2 / OMEGA, rel=FOUND)


# A half-explicit step is a perturbation of the true one: the steps of the kernels' own map agree to differences.
SAME_RADIUS = 1e-4
SINGLE_ROLLER = 0.02  # what its neighbours change through the ring; a run calls a step too long from 1.1 limits on


@pytest.mark.parametrize("speed", ["127 rpm", "3000 rpm"])
def test_the_limit_is_that_at_rest(speed):
    """A turning shaft drives points past rollers that they just touch; that is no stiffness."""
    model = parameters(paper_scene(shaft_speed=speed))
    assert 4 < step_limits.elastic_limit_s(METHODS["imex2"], model, equilibrium_state(model)) * 61440 < 5


@pytest.fixture(scope="module")
def rest():
    contact = {"roller_fit": "printed", "critical_velocity": "0.5 m/s"}
    return step_limits.balance_scene(paper_scene(contact=contact, defect={"kind": "outer"}), pitches=0.25)


def kernel_map(method: Method, model: Parameters, state: FloatArray, step_s: float) -> FloatArray:
    """Derivative of one step of the compiled method at `state`, by central differences; roller angles left out."""
    half, size = len(state) // 2, len(state)
    keep = np.r_[0 : half // 2 - 3, half - 6 : half, half:size, size + half : 2 * size]

    def step(start: FloatArray) -> FloatArray:
        run = full_run(model, start[:size].copy(), method, step_s)
        run.memory[:] = start[size:]
        run.advance(0, 1)
        return np.concatenate([run.state, run.memory])

    columns, base = [], np.concatenate([state, np.zeros(size)])
    for i in keep:
        nudge = np.eye(1, 2 * size, i)[0] * (1e-10 if i < half else 1e-6)
        columns.append((step(base + nudge) - step(base - nudge))[keep] / (2 * nudge[i]))
    return np.column_stack(columns)


@pytest.mark.parametrize("name", ["imex1", "imex2"])
@pytest.mark.parametrize("steps_per_s", [61440, 15360])
def test_the_kernels_step_grows_as_the_linear_map(name, steps_per_s, rest):
    model, state = rest
    with one_thread():
        method, h = METHODS[name], 1 / steps_per_s
        linear_map = step_limits.step_map(method, step_limits.linearise(model, state), h)
        own_map = kernel_map(method, model, state, h)
        linear, own = (np.abs(np.linalg.eigvals(one)).max() for one in (linear_map, own_map))
        assert own == pytest.approx(linear, rel=SAME_RADIUS)


@pytest.mark.parametrize(
    ("scene", "solvers"),
    [
        (paper_scene(), ("ode1", "imex2")),
        (paper_scene(contact={"roller_fit": "printed"}), ("ode4",)),
        (load_scene("rig"), ("imex2",)),  # two cages
    ],
    ids=["play 0", "interference", "rig"],
)
def test_one_roller_tells_the_whole_bearings_limit(scene, solvers):
    model, state = step_limits.balance_scene(scene)
    whole = step_limits.linearise(step_limits.without_friction(model), state)
    for name in solvers:
        limit = step_limits.elastic_limit_s(METHODS[name], model, state)
        expected = step_limits.longest_step(METHODS[name], whole)
        assert limit == pytest.approx(expected, rel=SINGLE_ROLLER), name
