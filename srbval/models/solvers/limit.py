"""The longest stable step of a method on a linear system."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from srbval.models.solvers.linear import Linear
from srbval.models.solvers.method import Method
from srbval.models.solvers.step_map import stability_function, step_map

ComplexArray = NDArray[np.complex128]

# Eigenvalues closer to zero are bodies that move freely, read with the rounding of the differences [1/s].
FREE_PER_S = 1.0
RAY = np.arange(0.005, 12.0, 0.005)  # |h lambda| looked at; no method here is stable further out
ROUNDING = 1e-9  # by which |R| may exceed one
# A step map may grow this much faster than the system itself does [1/s]: not noticeable in the runs there are.
GROWTH_PER_S = 1.0
SHORTEST_S, LONGEST_S = 1e-7, 1e-2  # steps looked at for implicit methods
PER_OCTAVE = 2
HALVINGS = 10


def longest_step(method: Method, system: Linear) -> float | None:
    """Longest step up to which every decaying motion of `system` decays [s]; None where no step looked at fails."""
    if method.implicit:
        return _of_map(lambda h: step_map(method, system, h), system)
    return explicit_limit(method, eigenvalues(system))


def explicit_limit(method: Method, values: ComplexArray) -> float | None:
    """Longest step of a Runge-Kutta method: |R(h lambda)| <= 1 for every decaying eigenvalue, [k] [1/s]."""
    size = np.abs(values)
    decaying = (size > FREE_PER_S) & (values.real < -1e-9 * size)
    limits = [_reach(method, complex(value / abs(value))) / float(abs(value)) for value in values[decaying]]
    return min(limits, default=None)


def _reach(method: Method, direction: complex) -> float:
    """How far along `direction`, of modulus one, |R| stays at or below one."""

    def outside(r: NDArray[np.float64]) -> NDArray[np.bool_]:
        ray: ComplexArray = r * np.complex128(direction)
        beyond: NDArray[np.bool_] = np.abs(stability_function(method, ray)) > 1 + ROUNDING
        return beyond

    found = outside(RAY)
    if not found.any():
        return math.inf
    first = int(np.argmax(found))
    low, high = float(RAY[first - 1]) if first else 0.0, float(RAY[first])
    return _bisect(low, high, lambda r: not outside(np.array([r]))[0])


def _of_map(make: Callable[[float], NDArray[np.float64]], system: Linear) -> float | None:
    grows = max(0.0, float(eigenvalues(system).real.max())) + GROWTH_PER_S

    def stable(h: float) -> bool:
        return spectral_radius(make(h)) <= math.exp(grows * h) + ROUNDING

    count = round(PER_OCTAVE * math.log2(LONGEST_S / SHORTEST_S))
    low = 0.0
    for h in np.geomspace(SHORTEST_S, LONGEST_S, count + 1):
        if not stable(float(h)):
            return _bisect(low, float(h), stable)
        low = float(h)
    return None


def eigenvalues(system: Linear) -> ComplexArray:
    """Eigenvalues of the system, [q + v] [1/s]."""
    return np.linalg.eigvals(system.matrix).astype(np.complex128)


def spectral_radius(matrix: NDArray[np.float64]) -> float:
    """Largest modulus of an eigenvalue."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _bisect(low: float, high: float, stable: Callable[[float], bool]) -> float:
    """Where `stable` ends between `low` and `high`."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low
