"""Coefficients of the implicit methods, on the scalar equation they are made for, in closed form.

x' = a x + J x with J implicit: L-stability, and agreement with exp to the order.
"""

from __future__ import annotations

import numpy as np
import pytest

from srbval.models.solvers import METHODS
from srbval.models.solvers.methods import LEAPFROG, ROSENBROCK


def growth(name: str, z: complex) -> complex:
    """x(h) / x(0) of x' = J x, z = h J, by the stages as the method's coefficients give them."""
    m = METHODS[name].coefficients
    s = 1 / (1 - m.implicit_coefficient * z)
    if m.family == LEAPFROG:
        k1 = s * z
        k2 = s * (z * (1 + k1) - 2 * k1)
        return 1 + sum(b * k for b, k in zip(m.b, (k1, k2), strict=False))
    assert m.family == ROSENBROCK
    u: list[complex] = []
    for stage in range(len(m.b)):
        state = 1 + sum(m.a[stage, p] * u[p] for p in range(stage))
        u.append(m.implicit_coefficient * s * (z * state + sum(m.g[stage, p] * u[p] for p in range(stage))))
    return 1 + sum(b * value for b, value in zip(m.b, u, strict=True))


# R(z) falls as 1/z for an L-stable method; at -1e9 some of 1e-9 is left.
STIFF, LEFT = -1e9, 1e-8
ROUNDING = 1e-12  # of |R| on the imaginary axis, where it is 1 for methods that do not damp
ORDER = 0.02  # of the order found from two steps 1e-3 apart: the next term of the error is a thousandth

IMPLICIT = [name for name, method in METHODS.items() if method.implicit]


@pytest.mark.parametrize("name", IMPLICIT)
def test_stiff_components_die_within_a_step(name: str) -> None:
    assert abs(growth(name, STIFF)) < LEFT
    ray = -np.logspace(-3, 6, 200)
    assert np.all(np.abs([growth(name, z) for z in ray]) < 1)
    assert np.all(np.abs([growth(name, 1j * z) for z in ray]) <= 1 + ROUNDING), "A-stable: the imaginary axis"


@pytest.mark.parametrize("name", IMPLICIT)
def test_order_on_a_linear_equation(name: str) -> None:
    coarse, fine = (abs(growth(name, z) - np.exp(z)) for z in (-2e-3, -1e-3))
    assert np.log2(coarse / fine) == pytest.approx(METHODS[name].order + 1, abs=ORDER)
