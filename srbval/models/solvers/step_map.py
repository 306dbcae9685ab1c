"""What one step of each method makes of a linear system: a number for a Runge-Kutta method, else a matrix.

The formulas are those of `explicit_kernel` and `implicit_kernel`, friction and damping implicit in the velocities,
stiffness explicit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from srbval.models.solvers.linear import Linear
from srbval.models.solvers.method import LEAPFROG, Coefficients, Method

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def stability_function(method: Method, z: ComplexArray) -> ComplexArray:
    """R(z) = 1 + z b' (1 - z A)^-1 1 of a Runge-Kutta method (Hairer & Wanner 1996, sect. IV.2), of the shape of `z`.

    For an explicit one a polynomial: its coefficients are b' A^k 1.
    """
    a, b = method.coefficients.a, method.coefficients.b
    power = np.ones(len(b))
    total = np.ones_like(z)
    for k in range(1, len(b) + 1):
        total = total + float(b @ power) * z**k
        power = a @ power
    return total


def step_map(method: Method, system: Linear, step_s: float) -> FloatArray:
    """Matrix of one step of an implicit method, [n, n]; n = q + v, and v more where the method remembers a step."""
    coefficients = method.coefficients
    damping = np.eye(len(system.damping)) - coefficients.gamma * step_s * system.damping
    damp = np.asarray(np.linalg.inv(damping), dtype=np.float64)
    make = _leapfrog if coefficients.family == LEAPFROG else _rosenbrock
    return make(coefficients, system, step_s, damp)


def _leapfrog(method: Coefficients, system: Linear, h: float, damp: FloatArray) -> FloatArray:
    """q, v and the predicted change of v, as `implicit_kernel.leapfrog_step` advances them."""
    places, speeds = system.motion.shape
    q, v, ahead = np.split(np.eye(places + 2 * speeds), [places, places + speeds])
    jacobian = system.damping
    q = q + method.c[0] * h * system.motion @ v
    predicted = v + ahead
    rise = system.stiffness @ q + jacobian @ predicted
    first = damp @ (rise - jacobian @ ahead)
    change = method.b[0] * first
    if len(method.b) == 2:
        second = damp @ (rise + jacobian @ (h * first - ahead) - 2 * first)
        change = change + method.b[1] * second
    v = v + h * change
    return np.vstack([q + (1 - method.c[0]) * h * system.motion @ v, v, method.ahead * h * change])


def _rosenbrock(method: Coefficients, system: Linear, h: float, damp: FloatArray) -> FloatArray:
    """q and v, as `implicit_kernel.rosenbrock_step` advances them; only the velocities are solved for."""
    places = len(system.motion)
    start = np.eye(sum(system.motion.shape))
    solve = np.eye(len(start))
    solve[places:, places:] = damp
    stages: list[FloatArray] = []
    for s in range(len(method.b)):
        trial = start + sum((method.a[s, p] * stages[p] for p in range(s)), np.zeros_like(start))
        right = system.matrix @ trial
        right = right + sum((method.g[s, p] / h * stages[p] for p in range(s)), np.zeros_like(start))
        stages.append(method.gamma * h * solve @ right)
    return start + sum((method.b[s] * stages[s] for s in range(len(stages))), np.zeros_like(start))
