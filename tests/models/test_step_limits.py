"""Step limits: of one roller before a run, and of the whole bearing made linear, against the compiled steps."""

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import take_steps
from srbval.models.full_run import elastic_limit_s, stiffest_roller, without_friction
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.linear_stability import longest_step, spectral_radius, step_map
from srbval.models.solvers import METHODS, Method
from srbval.models.step_limits import balanced, linearise
from srbval.processes.machine import one_thread
from srbval.scene import Scene, load_scene, paper_scene
from tests.verification.harness import parameters

# A half-explicit step is a perturbation of the true one: the steps of the kernels' own map agree to differences.
SAME_RADIUS = 1e-4
SINGLE_ROLLER = 0.02  # what its neighbours change through the ring; a run calls a step too long from 1.1 limits on
EULER = 1e-4  # of c / k, which holds where an oscillation is damped far below critical


@pytest.mark.parametrize("speed", ["127 rpm", "3000 rpm"])
def test_the_limit_is_that_at_rest(speed: str) -> None:
    """A turning shaft drives points past rollers that they just touch; that is no stiffness."""
    model = parameters(paper_scene(shaft_speed=speed))
    found = elastic_limit_s(METHODS["imex2"], model, equilibrium_state(model))
    assert 4 < found * 61440 < 5


def test_euler_needs_a_step_below_damping_over_stiffness() -> None:
    """The explicit Euler method damps an oscillator only up to c / k (Hairer & Wanner 1996, sect. IV.2)."""
    model = parameters(paper_scene())
    state = equilibrium_state(model)
    roller = stiffest_roller(without_friction(model), state)
    expected = roller.damping[0, 0] / roller.stiffness[0, 0]
    assert elastic_limit_s(METHODS["ode1"], model, state) == pytest.approx(expected, rel=EULER)


@pytest.fixture(scope="module")
def rest() -> tuple[Parameters, FloatArray]:
    contact = {"roller_fit": "printed", "critical_velocity": "0.5 m/s"}
    return balanced(paper_scene(contact=contact, defect={"kind": "outer"}), pitches=0.25)


def kernel_map(method: Method, model: Parameters, state: FloatArray, step_s: float, remembers: bool) -> FloatArray:
    """Derivative of one step of the compiled method at `state`, by central differences; roller angles left out."""
    half, size = len(state) // 2, len(state)
    rollers = half // 2 - 3
    whole = 2 * size if remembers else size
    keep = np.r_[0:rollers, 2 * rollers : half, half:size]
    if remembers:
        keep = np.r_[keep, size + half : 2 * size]

    def step(start: FloatArray) -> FloatArray:
        y, memory = start[:size].copy(), start[size:].copy() if remembers else np.zeros(size)
        take_steps(model, y, method, step_s=step_s, intervals=range(1), memory=memory)
        return np.concatenate([y, memory])[:whole]

    columns = []
    base = np.concatenate([state, np.zeros(whole - size)])
    for i in keep:
        nudge = np.zeros(whole)
        nudge[i] = 1e-10 if i < half else 1e-6
        columns.append((step(base + nudge) - step(base - nudge))[keep] / (2 * nudge[i]))
    return np.column_stack(columns)


@pytest.mark.parametrize(("name", "remembers"), [("imex1", False), ("imex2", True), ("ros2", False)])
@pytest.mark.parametrize("steps_per_s", [61440, 15360])
def test_the_kernels_step_grows_as_the_linear_map(
    name: str, remembers: bool, steps_per_s: int, rest: tuple[Parameters, FloatArray]
) -> None:
    model, state = rest
    with one_thread():
        method, h = METHODS[name], 1 / steps_per_s
        linear = step_map(method, linearise(model, state), h)
        own = kernel_map(method, model, state, h, remembers)
        assert spectral_radius(own) == pytest.approx(spectral_radius(linear), rel=SAME_RADIUS)


@pytest.mark.parametrize(
    ("scene", "solvers"),
    [
        (paper_scene(), ("ode1", "imex2")),
        (paper_scene(contact={"roller_fit": "printed"}), ("ode4",)),
        (load_scene("rig"), ("imex2",)),  # two cages
    ],
    ids=["play 0", "interference", "rig"],
)
def test_one_roller_tells_the_whole_bearings_limit(scene: Scene, solvers: tuple[str, ...]) -> None:
    model = level_of(scene.model).make_parameters(scene, geometry_of(load_bearing(scene.bearing)))
    state = equilibrium_state(model)
    still, at_rest = balanced(scene)
    whole = linearise(without_friction(still), at_rest)
    for name in solvers:
        limit, expected = elastic_limit_s(METHODS[name], model, state), longest_step(METHODS[name], whole)
        assert limit == pytest.approx(expected, rel=SINGLE_ROLLER), name
