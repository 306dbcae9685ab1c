"""Explicit Runge-Kutta methods of fixed step: the paper's ODE4 and the lower orders it rules out.

Names follow the paper's simulation software: ode1 Euler, ode2 Heun, ode3 Bogacki & Shampine (1989), ode4 the
classical method (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, 1993, sect. II.1).
On the negative real axis they are stable to 2, 2, 2.51 and 2.79 over the largest rate. The full model's
friction relaxes some 300 times faster than ode4 resolves at 1/61440 s: it chatters, bounded, instead of
diverging, and the chatter is broadband noise in the acceleration. No step control, no implicit part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Tableau:
    """Butcher tableau: `a` shape [s, s] strictly lower, `b` and `c` shape [s]; `order` of consistency."""

    order: int
    a: FloatArray
    b: FloatArray
    c: FloatArray


def _tableau(order: int, a: list[list[float]], b: list[float]) -> Tableau:
    stages = len(b)
    matrix = np.zeros((stages, stages))
    for i, row in enumerate(a, start=1):
        matrix[i, : len(row)] = row
    return Tableau(order=order, a=matrix, b=np.array(b), c=matrix.sum(axis=1))


TABLEAUX = {
    "ode1": _tableau(1, [], [1.0]),
    "ode2": _tableau(2, [[1.0]], [0.5, 0.5]),
    "ode3": _tableau(3, [[0.5], [0.0, 0.75]], [2 / 9, 3 / 9, 4 / 9]),
    "ode4": _tableau(4, [[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 2 / 6, 2 / 6, 1 / 6]),
}
