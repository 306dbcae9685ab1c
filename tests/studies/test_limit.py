"""Predicted step limits against closed forms and against the kernels' own steps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import take_steps
from srbval.models.solvers import METHODS, Method
from srbval.models.solvers.linear_stability import (
    Linear,
    explicit_limit,
    longest_step,
    spectral_radius,
    stability_function,
    step_map,
)
from srbval.models.step_limit import without_friction
from srbval.studies.stability.grid import FULL, StabilityCase, StabilityGroup
from srbval.studies.stability.step_limits import balanced, linearise

FloatArray = NDArray[np.float64]

OMEGA = 3e4  # rad/s, that of a loaded roller
# Limits are bisected from rays of 0.005 and octaves of steps: ten halvings leave less than this.
FOUND = 1e-3
# Largest real and imaginary z with |R(z)| <= 1 (Hairer & Wanner 1996, sect. IV.2; Kutta's classical method: 2.785 and
# 2 sqrt 2); Euler's and Heun's methods hold no undamped oscillation.
REAL_LIMITS = {"ode1": 2.0, "ode2": 2.0, "ode3": 2.512745, "ode4": 2.785293}
IMAGINARY_LIMITS = {"ode3": np.sqrt(3), "ode4": np.sqrt(8)}
# A half-explicit step is a perturbation of the true one: the steps of the kernels' own map agree to differences.
SAME_RADIUS = 1e-4
RAY = 2e-2  # the limit is looked up on rays, and Euler's region is flat along the imaginary axis
NEXT_TERM = 2  # the first term left out of the exponential is at most |z|^(order + 1), and some more follow
OTHER_DAMPING = 0.1  # of the fastest motion, what is not friction
STRUCTURAL_RATE = 1e5  # 1/s: without friction only the contacts' own damping remains, which is far slower


def oscillator(damping_per_s: float = 0.0) -> Linear:
    return Linear(
        motion=np.ones((1, 1)), stiffness=np.full((1, 1), -(OMEGA**2)), damping=np.full((1, 1), -damping_per_s)
    )


@pytest.mark.parametrize(("name", "limit"), REAL_LIMITS.items())
def test_decay(name: str, limit: float) -> None:
    found = explicit_limit(METHODS[name], np.array([-5e7 + 0j]))
    assert found == pytest.approx(limit / 5e7, rel=FOUND)


@pytest.mark.parametrize(("name", "limit"), IMAGINARY_LIMITS.items())
def test_oscillation(name: str, limit: float) -> None:
    weakly = OMEGA * complex(-1e-7, 1)
    found = explicit_limit(METHODS[name], np.array([weakly, weakly.conjugate()]))
    assert found == pytest.approx(limit / OMEGA, rel=FOUND)


@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_euler_holds_a_damped_oscillation_to_twice_its_decay(damping: float) -> None:
    """|1 + h lambda|^2 <= 1 to h = -2 Re lambda / |lambda|^2."""
    decay = OMEGA * complex(-damping, np.sqrt(1 - damping**2))
    assert explicit_limit(METHODS["ode1"], np.array([decay])) == pytest.approx(2 * damping / OMEGA, rel=RAY)


@pytest.mark.parametrize("name", ["imex1", "imex2"])
def test_leapfrog_is_stable_to_two_over_the_frequency(name: str) -> None:
    assert longest_step(METHODS[name], oscillator()) == pytest.approx(2 / OMEGA, rel=FOUND)


@pytest.mark.parametrize("name", ["imex1", "imex2", "ros2"])
def test_implicit_damping_alone_sets_no_limit(name: str) -> None:
    system = Linear(motion=np.ones((1, 1)), stiffness=np.zeros((1, 1)), damping=np.full((1, 1), -5e7))
    assert longest_step(METHODS[name], system) is None


def test_free_and_growing_motions_set_no_limit() -> None:
    assert explicit_limit(METHODS["ode4"], np.array([0j, 1e-3 + 0j, 150 + 0j])) is None


@pytest.mark.parametrize("name", ["ode1", "ode2", "ode3", "ode4"])
def test_stability_function_is_the_exponential_to_the_method_s_order(name: str) -> None:
    method, z = METHODS[name], 0.01 * np.exp(1j * np.array([0.3, 2.0, np.pi]))
    assert np.abs(stability_function(method, z) - np.exp(z)).max() < NEXT_TERM * 0.01 ** (method.order + 1)


@pytest.fixture(scope="module")
def rest() -> tuple[Parameters, FloatArray]:
    group = StabilityGroup(scene="interference-outer", rpm=710.0, critical_velocity_m_s=0.5)
    return balanced(FULL.scene(StabilityCase(group=group, solver="imex2", steps_per_s=61440)), pitches=0.25)


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
        take_steps(model, y, method, step_s=step_s, intervals=1, memory=memory)
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
    from threadpoolctl import threadpool_limits

    model, state = rest
    with threadpool_limits(1):
        method, h = METHODS[name], 1 / steps_per_s
        linear = step_map(method, linearise(model, state), h)
        own = kernel_map(method, model, state, h, remembers)
        assert spectral_radius(own) == pytest.approx(spectral_radius(linear), rel=SAME_RADIUS)


def test_friction_at_rest_has_the_slope_of_the_steepest_contact(rest: tuple[Parameters, FloatArray]) -> None:
    """A hundredth of the critical velocity makes friction relax a hundred times faster; without it nothing does."""
    from threadpoolctl import threadpool_limits

    model, state = rest
    fast = model._replace(law=model.law._replace(critical_velocity=0.005))
    with threadpool_limits(1):
        slow_rate, fast_rate, none = (
            -np.linalg.eigvals(linearise(m, state).matrix).real.min() for m in (model, fast, without_friction(model))
        )
    assert fast_rate == pytest.approx(100 * slow_rate, rel=OTHER_DAMPING)
    assert none < STRUCTURAL_RATE
