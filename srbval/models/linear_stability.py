"""Stability of the methods on a linear mechanical system: the map of one step, and the longest stable step.

The formulas are those of `step_kernel`, friction and damping implicit in the velocities, stiffness explicit.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import ComplexArray, FloatArray
from srbval.models.solvers import LEAPFROG, Coefficients, Method

# Eigenvalues closer to zero are bodies that move freely, read with the rounding of the differences [1/s].
FREE_PER_S = 1.0
RAY = np.arange(0.005, 12.0, 0.005)  # |h lambda| looked at; no method here is stable further out
ROUNDING = 1e-9  # excess of |R| over one that counts as stable
# A step map may grow this much faster than the system itself does [1/s]: not noticeable in the runs there are.
GROWTH_PER_S = 1.0
SHORTEST_S, LONGEST_S = 1e-7, 1e-2  # steps looked at for implicit methods
PER_OCTAVE = 2
HALVINGS = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """q' = `motion` v, v' = `stiffness` q + `damping` v: shapes [q, v], [v, q] and [v, v].

    Of the full model, q are slides, cage angles and ring displacement, v all generalised speeds; the rollers' angles
    about their axes are left out, as nothing depends on them unless a roller is damaged.
    """

    motion: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """The system's matrix, [q + v, q + v]."""
        still = np.zeros((len(self.motion), len(self.motion)))
        return np.block([[still, self.motion], [self.stiffness, self.damping]])


def longest_step(method: Method, system: Linear) -> float | None:
    """Longest step up to which every decaying motion of `system` decays [s]; None if no step tried fails."""
    if not method.implicit:
        return explicit_limit(method, eigenvalues(system))
    grows = max(0.0, float(eigenvalues(system).real.max())) + GROWTH_PER_S

    def stable(h: float) -> bool:
        return spectral_radius(step_map(method, system, h)) <= math.exp(grows * h) + ROUNDING

    low = 0.0
    for h in np.geomspace(SHORTEST_S, LONGEST_S, round(PER_OCTAVE * math.log2(LONGEST_S / SHORTEST_S)) + 1).tolist():
        if not stable(h):
            return _bisect(low, h, stable)
        low = h
    return None


def explicit_limit(method: Method, values: ComplexArray) -> float | None:
    """Longest step of a Runge-Kutta method: |R(h lambda)| <= 1 for every decaying eigenvalue, [k] [1/s]."""
    size = np.abs(values)
    decaying = (size > FREE_PER_S) & (values.real < -1e-9 * size)
    limits = [_reach(method, complex(value / abs(value))) / float(abs(value)) for value in values[decaying]]
    return min(limits, default=None)


def _reach(method: Method, direction: complex) -> float:
    """Distance along `direction`, of modulus one, up to which |R| stays at or below one."""

    def outside(r: NDArray[np.float64]) -> NDArray[np.bool_]:
        ray: ComplexArray = r * np.complex128(direction)
        return np.abs(stability_function(method, ray)) > 1 + ROUNDING

    found = outside(RAY)
    if not found.any():
        return math.inf
    first = int(np.argmax(found))
    low, high = float(RAY[first - 1]) if first else 0.0, float(RAY[first])
    return _bisect(low, high, lambda r: not outside(np.array([r]))[0])


def eigenvalues(system: Linear) -> ComplexArray:
    """Eigenvalues of the system, [q + v] [1/s]."""
    return np.linalg.eigvals(system.matrix).astype(np.complex128)


def spectral_radius(matrix: NDArray[np.float64]) -> float:
    """Largest modulus of an eigenvalue."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _bisect(low: float, high: float, stable: Callable[[float], bool]) -> float:
    """Value between `low` and `high` at which `stable` ends."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


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
    """Matrix of one step of an implicit method, [n, n]; n = q + v, and v more if the method remembers a step."""
    coefficients = method.coefficients
    damping = np.eye(len(system.damping)) - coefficients.implicit_coefficient * step_s * system.damping
    damp = np.asarray(np.linalg.inv(damping), dtype=np.float64)
    make = _leapfrog if coefficients.family == LEAPFROG else _rosenbrock
    return make(coefficients, system, step_s, damp)


def _leapfrog(method: Coefficients, system: Linear, h: float, damp: FloatArray) -> FloatArray:
    """q, v and the predicted change of v, as `step_kernel.leapfrog_step` advances them."""
    coordinates, speeds = system.motion.shape
    q, v, ahead = np.split(np.eye(coordinates + 2 * speeds), [coordinates, coordinates + speeds])
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
    """q and v, as `step_kernel.rosenbrock_step` advances them; only the velocities are solved for."""
    coordinates = len(system.motion)
    start = np.eye(sum(system.motion.shape))
    solve = np.eye(len(start))
    solve[coordinates:, coordinates:] = damp
    stages: list[FloatArray] = []
    for s in range(len(method.b)):
        trial = start + sum((method.a[s, p] * stages[p] for p in range(s)), np.zeros_like(start))
        right = system.matrix @ trial
        right = right + sum((method.g[s, p] / h * stages[p] for p in range(s)), np.zeros_like(start))
        stages.append(method.implicit_coefficient * h * solve @ right)
    return start + sum((method.b[s] * stages[s] for s in range(len(stages))), np.zeros_like(start))
