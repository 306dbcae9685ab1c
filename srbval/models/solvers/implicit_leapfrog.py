"""One evaluation a step: leapfrog for the positions, a second-order L-stable formula for friction and damping.

Half a step of the positions, a step of the velocities with the positions held, half a step of the positions (Strang
splitting; Hairer, Lubich & Wanner, Geometric Numerical Integration, 2006, sect. II.5). Within the middle part
forces are linear in the velocities, f + J (v - v0), and the two-stage formula of `w_method` is applied to that linear
equation: one evaluation, one factorisation, two solutions. Forces are made linear about the velocities predicted for
the middle of the step, v + (v - v_last) / 2: about v itself, points that begin to slide are held too long. So
v - v0 is of second order in the step's mean, and the method is of second order whatever stands for J: also where points
slide, though friction's secant (see `damping_kernel`) is the Jacobian only while they stick. Stable to 2 over the
largest natural frequency of the contacts. The first step of a run has no last one and predicts
nothing. Points come into contact over two steps, see `contact_columns`.

The same of first order: velocities by the linearly implicit Euler method, then positions with them.

    (M + h D) (v' - v) = h f(q, v),   q' = q + h v'

Friction and damping, in D, are L-stable; contact stiffness is taken as by the symplectic Euler method, stable to 2 over
the largest natural frequency (ibid., sect. I.1.2). It is the cheapest step there is, and the most damped: what friction
lets slide slowly is slowed to first order only.
"""

import math

import numpy as np

from srbval.models.solvers.method import LEAPFROG, ONSET, Coefficients, Method

GAMMA = 1 - 1 / math.sqrt(2)  # the smaller root: sharper, and the step has no positions that could go wrong
NONE = np.zeros((1, 1))

IMEX2 = Method(
    name="imex2",
    title="leapfrog, friction and damping implicit",
    order=2,
    evaluations=1,
    implicit=True,
    coefficients=Coefficients(
        LEAPFROG, NONE, np.array([1.5, 0.5]), np.array([0.5]), NONE, np.array([1.0]), GAMMA, 0.5, ONSET
    ),
)
IMEX1 = Method(
    name="imex1",
    title="linearly implicit Euler, friction and damping implicit",
    order=1,
    evaluations=1,
    implicit=True,
    coefficients=Coefficients(LEAPFROG, NONE, np.array([1.0]), np.array([0.0]), NONE, np.array([1.0]), 1.0, 0.0, ONSET),
)
