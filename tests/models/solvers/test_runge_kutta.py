from __future__ import annotations

import numpy as np
import pytest

from srbval.models.solvers import METHODS
from srbval.models.solvers.methods import RUNGE_KUTTA

ROUNDING = 1e-15  # of sums of a few fractions below one
EXPLICIT = [name for name, method in METHODS.items() if method.coefficients.family == RUNGE_KUTTA]


@pytest.mark.parametrize("name", EXPLICIT)
def test_order_conditions(name: str) -> None:
    """Hairer, Norsett & Wanner I, sect. II.2: one equation per rooted tree up to order 4."""
    t = METHODS[name].coefficients
    a, b, c = t.a, t.b, t.c
    conditions = [
        [(b.sum(), 1)],
        [(b @ c, 1 / 2)],
        [(b @ c**2, 1 / 3), (b @ a @ c, 1 / 6)],
        [(b @ c**3, 1 / 4), (b @ (c * (a @ c)), 1 / 8), (b @ a @ c**2, 1 / 12), (b @ a @ a @ c, 1 / 24)],
    ]
    for order, equations in enumerate(conditions, start=1):
        met = all(np.isclose(found, wanted, atol=ROUNDING) for found, wanted in equations)
        assert met == (order <= METHODS[name].order), f"order {order}"


@pytest.mark.parametrize("name", EXPLICIT)
def test_methods_are_explicit(name: str) -> None:
    a = METHODS[name].coefficients.a
    assert np.array_equal(a, np.tril(a, -1))
