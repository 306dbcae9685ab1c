"""Linear stability of the solvers: limits of decay and oscillation that theory states."""

import numpy as np
import pytest

from srbval.models.linear_stability import Linear, explicit_limit, longest_step, stability_function
from srbval.models.solvers import METHODS

OMEGA = 3e4  # rad/s, that of a loaded roller
# Limits are bisected from rays of 0.005 and octaves of steps: ten halvings leave less than this.
FOUND = 1e-3
# Largest real and imaginary z with |R(z)| <= 1 (Hairer & Wanner 1996, sect. IV.2; Kutta's classical method: 2.785 and
# 2 sqrt 2); Euler's and Heun's methods hold no undamped oscillation.
REAL_LIMITS = {"ode1": 2.0, "ode2": 2.0, "ode3": 2.512745, "ode4": 2.785293}
IMAGINARY_LIMITS = {"ode3": np.sqrt(3), "ode4": np.sqrt(8)}
NEXT_TERM = 2  # the first term left out of the exponential is at most |z|^(order + 1), and some more follow


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


@pytest.mark.parametrize("name", ["imex1", "imex2"])
def test_leapfrog_is_stable_to_two_over_the_frequency(name: str) -> None:
    assert longest_step(METHODS[name], oscillator()) == pytest.approx(2 / OMEGA, rel=FOUND)


@pytest.mark.parametrize("name", ["ode1", "ode2", "ode3", "ode4"])
def test_stability_function_is_the_exponential_to_the_method_s_order(name: str) -> None:
    method, z = METHODS[name], 0.01 * np.exp(1j * np.array([0.3, 2.0, np.pi]))
    assert np.abs(stability_function(method, z) - np.exp(z)).max() < NEXT_TERM * 0.01 ** (method.order + 1)
