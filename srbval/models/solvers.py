"""Methods of time integration: their coefficients for the kernels and their properties; `METHODS` by name.

Explicit Runge-Kutta methods of fixed step: the paper's ODE4 and the lower orders it rules out. Names follow the paper's
simulation software: ode1 Euler, ode2 Heun, ode3 Bogacki & Shampine (1989), ode4 the classical method (Hairer, Norsett &
Wanner, Solving Ordinary Differential Equations I, 1993, sect. II.1). On the negative real axis they are stable to 2, 2,
2.51 and 2.79 over the largest rate. The full model's friction relaxes some 300 times faster than ode4 resolves at
1/61440 s: it chatters, bounded, instead of diverging, and the chatter is broadband noise in the acceleration.

Others take friction and contact damping implicitly. ros2, a two-stage W-method (Verwer, Spee, Blom & Hundsdorfer, A
second-order Rosenbrock method applied to photochemical dispersion problems, SIAM J. Sci. Comput. 20 (1999) 1456): with
S = (1 - gamma h J)^-1

    k1 = S f(y),   k2 = S (f(y + h k1) - 2 k1),   y + h (3/2 k1 + 1/2 k2)

is of second order whatever stands for the Jacobian J, and L-stable in what J holds for gamma = 1 +- 1/sqrt 2 (the
larger one keeps all components positive). Here J holds the damping matrix of `damping_kernel` alone: friction and
contact damping set no limit to the step, contact stiffness does, as in Heun's method with the damping there is. J is
factored once and turns on with the slots' axes to the second stage, which changes it by the order of the step and so
leaves the method's. The stages are written for u = gamma h k, which needs no product with J (Hairer & Wanner, Solving
Ordinary Differential Equations II, 1996, sect. IV.7). Points that enter and leave contact limit the observed order.

imex2, one evaluation a step: half a step of the positions, a step of the velocities with the positions held, half a
step of the positions (Strang splitting; Hairer, Lubich & Wanner, Geometric Numerical Integration, 2006, sect. II.5).
Within the middle part forces are linear in the velocities, f + J (v - v0), and the formula of ros2 is applied to that
linear equation: one evaluation, one factorisation, two solutions. Forces are made linear about the velocities predicted
for the middle of the step, v + (v - v_last) / 2: about v itself, points that begin to slide are held too long. So
v - v0 is of second order in the step's mean, and the method is of second order whatever stands for J: also where points
slide, though friction's secant (see `damping_kernel`) is the Jacobian only while they stick. Stable to 2 over the
largest natural frequency of the contacts. The first step of a run has no last one and predicts nothing. Points come
into contact over two steps, see `contact_columns`.

imex1, the same of first order: velocities by the linearly implicit Euler method, then positions with them.

    (M + h D) (v' - v) = h f(q, v),   q' = q + h v'

Friction and damping, in D, are L-stable; contact stiffness is taken as by the symplectic Euler method, stable to 2 over
the largest natural frequency (ibid., sect. I.1.2). It is the cheapest step there is, and the most damped: what friction
lets slide slowly is slowed to first order only.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray

FAMILIES = ("explicit", "rosenbrock", "leapfrog")  # one kernel each
RUNGE_KUTTA, ROSENBROCK, LEAPFROG = range(3)
ONSET = 2.0  # implicit methods: neighbouring steps share a point's coming into contact; 1 leaves more noise
GAMMA_ROS2 = 1 + 1 / math.sqrt(2)
GAMMA_IMEX2 = 1 - 1 / math.sqrt(2)  # the smaller root: sharper, and the step has no positions that could go wrong


class Coefficients(NamedTuple):
    """Numbers of a method as the kernels read them.

    `a`, shape [s, s]: what a stage's state takes of earlier stages; `b`, [s]: what the result takes of them; `c`, [s]:
    the stages' times; `g`, [s, s]: what a stage's right-hand side takes of earlier stages; `powers`, [s]: weights of
    the stages in mean forces and powers; `implicit_coefficient`: gamma of a W-method, the share of the step by
    which friction and damping are taken implicitly;
    `ahead`: share of the last change of the velocities by which a leapfrog predicts where forces are made linear;
    `onset`: steps over which a point's coming into contact is averaged, see `contact_columns`.
    A leapfrog has one stage, `c` of a step after the step's start, and solves its linear equations ``len(b)`` times.
    """

    family: int
    a: FloatArray
    b: FloatArray
    c: FloatArray
    g: FloatArray
    powers: FloatArray
    implicit_coefficient: float
    ahead: float
    onset: float


@dataclass(frozen=True, kw_only=True)
class Method:
    """One-step method: its `order` of consistency and its `evaluations` of the right-hand side in a step.

    `implicit` is true if the method takes friction and damping implicitly.
    """

    name: str
    title: str
    order: int
    evaluations: int
    implicit: bool
    coefficients: Coefficients


def _lower(size: int, rows: list[list[float]]) -> FloatArray:
    """A strictly lower triangular matrix, [size, size], from its rows after the first."""
    matrix = np.zeros((size, size))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix


def explicit(name: str, title: str, order: int, a: list[list[float]], b: list[float]) -> Method:
    """A Runge-Kutta method from the rows of its Butcher tableau after the first."""
    matrix, weights = _lower(len(b), a), np.array(b)
    numbers = (matrix, weights, matrix.sum(axis=1), np.zeros_like(matrix), weights, 0.0, 0.0, 0.0)
    return Method(
        name=name,
        title=title,
        order=order,
        evaluations=len(b),
        implicit=False,
        coefficients=Coefficients(RUNGE_KUTTA, *numbers),
    )


def _leapfrog(name: str, title: str, b: list[float], before: float, gamma: float, ahead: float) -> Method:
    none = np.zeros((1, 1))
    numbers = (none, np.array(b), np.array([before]), none, np.ones(1), gamma, ahead, ONSET)
    return Method(
        name=name,
        title=title,
        order=len(b),
        evaluations=1,
        implicit=True,
        coefficients=Coefficients(LEAPFROG, *numbers),
    )


ROS2 = Method(
    name="ros2",
    title="two-stage W-method, friction and damping implicit",
    order=2,
    evaluations=2,
    implicit=True,
    coefficients=Coefficients(
        ROSENBROCK,
        a=_lower(2, [[1 / GAMMA_ROS2]]),
        b=np.array([3, 1]) / (2 * GAMMA_ROS2),
        c=np.array([0.0, 1.0]),
        g=_lower(2, [[-2 / GAMMA_ROS2]]),
        powers=np.array([0.5, 0.5]),
        implicit_coefficient=GAMMA_ROS2,
        ahead=0.0,
        onset=ONSET,
    ),
)
METHODS = {
    method.name: method
    for method in (
        explicit("ode1", "Euler", 1, [], [1.0]),
        explicit("ode2", "Heun", 2, [[1.0]], [0.5, 0.5]),
        explicit("ode3", "Bogacki-Shampine", 3, [[0.5], [0.0, 0.75]], [2 / 9, 3 / 9, 4 / 9]),
        explicit(
            "ode4", "classical Runge-Kutta", 4, [[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 2 / 6, 2 / 6, 1 / 6]
        ),
        _leapfrog("imex1", "linearly implicit Euler, friction and damping implicit", [1.0], 0.0, 1.0, 0.0),
        _leapfrog("imex2", "leapfrog, friction and damping implicit", [1.5, 0.5], 0.5, GAMMA_IMEX2, 0.5),
        ROS2,
    )
}
SOLVERS = tuple(METHODS)
