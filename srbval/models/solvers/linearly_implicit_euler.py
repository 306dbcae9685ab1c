"""First order, one evaluation a step: velocities by the linearly implicit Euler method, then positions with them.

    (M + h D) (v' - v) = h f(q, v),   q' = q + h v'

Friction and damping, in D, are L-stable; contact stiffness is taken as by the symplectic Euler method, stable to 2 over
the largest natural frequency (Hairer, Lubich & Wanner, Geometric Numerical Integration, 2006, sect. I.1.2). It
is the cheapest step there is, and the most damped: what friction lets slide slowly is slowed to first order only.
"""

import numpy as np

from srbval.models.solvers.method import LEAPFROG, ONSET, Coefficients, Method

NONE = np.zeros((1, 1))

IMEX1 = Method(
    name="imex1",
    title="linearly implicit Euler, friction and damping implicit",
    order=1,
    evaluations=1,
    implicit=True,
    coefficients=Coefficients(LEAPFROG, NONE, np.array([1.0]), np.array([0.0]), NONE, np.array([1.0]), 1.0, 0.0, ONSET),
)
