"""Methods of time integration: coefficients for the kernels and properties, by name in `METHODS`.

Explicit Runge-Kutta methods of fixed step: the paper's ODE4 and the lower orders it rules out. Names follow the paper's
simulation software: ode1 Euler, ode2 Heun, ode3 Bogacki & Shampine (1989), ode4 the classical method (Hairer, Norsett &
Wanner, Solving Ordinary Differential Equations I, 1993, sect. II.1). On the negative real axis steps are stable up
to 2, 2, 2.51 and 2.79 over the largest rate. The full model's friction relaxes some 300 times faster than ode4 resolves
at 1/61440 s: it chatters, bounded, instead of diverging, and the chatter is broadband noise in the acceleration.

The other methods treat friction and contact damping implicitly. ros2, a two-stage W-method (Verwer, Spee, Blom &
Hundsdorfer, A second-order Rosenbrock method applied to photochemical dispersion problems, SIAM J. Sci. Comput. 20
(1999) 1456): with S = (1 - gamma h J)^-1

    k1 = S f(y),   k2 = S (f(y + h k1) - 2 k1),   y + h (3/2 k1 + 1/2 k2)

is of second order with any matrix J in place of the Jacobian, and L-stable for the forces that J contains if gamma =
1 +- 1/sqrt 2 (the larger value keeps all components positive). Here J contains only the damping matrix of
`damping_kernel`: friction and contact damping do not limit the step; contact stiffness does, as in Heun's method with
the same damping. J is factored once and rotates with the slots' axes until the second stage, a change of the order of
the step, which does not lower the order of the method. The stages are written for u = gamma h k, which needs no product
with J (Hairer & Wanner, Solving Ordinary Differential Equations II, 1996, sect. IV.7). Points that enter and leave
contact limit the observed order.

imex2, one evaluation per step: half a step of the positions, a step of the velocities at constant positions, half a
step of the positions (Strang splitting; Hairer, Lubich & Wanner, Geometric Numerical Integration, 2006, sect. II.5).
Within the middle part forces are linear in the velocities, f + J (v - v0), and the formula of ros2 is applied to this
linear equation: one evaluation, one factorisation, two solutions. Forces are linearised about the velocities predicted
for the middle of the step, v + (v - v_last) / 2, because about v itself points begin to slide too late. The mean of
v - v0 is then of second order in the step, and so is the method with any J, even if points slide and the secant of
friction (see `damping_kernel`) is not the Jacobian. Stable to 2 over the largest natural frequency of the contacts. The
first step of a run has no preceding step and predicts no change. Points come into contact over two steps, see
`contact_columns`.

imex1, of first order: velocities by the linearly implicit Euler method, then positions with the new velocities.

    (M + h D) (v' - v) = h f(q, v),   q' = q + h v'

Friction and damping, in D, are L-stable; contact stiffness is integrated by the symplectic Euler method, stable to 2
over the largest natural frequency (ibid., sect. I.1.2). This step is the cheapest and the most damped: slow sliding is
accurate to first order only.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray

FAMILIES = ("explicit", "rosenbrock", "leapfrog")  # a kernel for each family
RUNGE_KUTTA, ROSENBROCK, LEAPFROG = range(3)
ONSET_STEPS = 2.0  # implicit methods: a point comes into contact over two steps; one step is noisier
GAMMA_ROS2 = 1 + 1 / math.sqrt(2)
GAMMA_IMEX2 = 1 - 1 / math.sqrt(2)  # the smaller root is more accurate; the linear equation contains no positions


class Coefficients(NamedTuple):
    """Coefficients of a method with s stages for the kernels.

    `a`, [s, s]: weights of earlier stages in a stage's state; `b`, [s]: weights of the stages in the result; `c`, [s]:
    times of the stages in steps; `g`, [s, s]: weights of earlier stages in a stage's right-hand side; `powers`, [s]:
    weights of the stages in mean forces and powers; `implicit_coefficient`: gamma of a W-method, the share of the step
    for which friction and damping are implicit; `ahead`: share of the last change of the velocities by which a leapfrog
    predicts the velocities at which forces are linearised; `onset`: steps over which a new contact of a point is
    averaged, see `contact_columns`.

    A leapfrog has one stage at the time `c` of a step, and solves its linear equations ``len(b)`` times.
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
    """Method of time integration: its name, title, `order` of consistency and coefficients."""

    name: str
    title: str
    order: int
    coefficients: Coefficients

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the right-hand side in a step."""
        return len(self.coefficients.c)

    @property
    def implicit(self) -> bool:
        """True if friction and damping are integrated implicitly."""
        return self.coefficients.family != RUNGE_KUTTA


def _lower_triangle(size: int, rows: list[list[float]]) -> FloatArray:
    """Make a strictly lower triangular matrix, [size, size], from the rows after the first."""
    matrix = np.zeros((size, size))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix


def explicit(name: str, title: str, order: int, a: list[list[float]], b: list[float]) -> Method:
    """Make an explicit Runge-Kutta method from the rows of its Butcher tableau after the first, and its weights."""
    matrix, weights = _lower_triangle(len(b), a), np.array(b)
    numbers = (matrix, weights, matrix.sum(axis=1), np.zeros_like(matrix), weights, 0.0, 0.0, 0.0)
    return Method(name=name, title=title, order=order, coefficients=Coefficients(RUNGE_KUTTA, *numbers))


def _leapfrog(name: str, title: str, b: list[float], before: float, gamma: float, ahead: float) -> Method:
    none = np.zeros((1, 1))
    numbers = (none, np.array(b), np.array([before]), none, np.ones(1), gamma, ahead, ONSET_STEPS)
    return Method(name=name, title=title, order=len(b), coefficients=Coefficients(LEAPFROG, *numbers))


ROS2 = Method(
    name="ros2",
    title="two-stage W-method, friction and damping implicit",
    order=2,
    coefficients=Coefficients(
        ROSENBROCK,
        a=_lower_triangle(2, [[1 / GAMMA_ROS2]]),
        b=np.array([3, 1]) / (2 * GAMMA_ROS2),
        c=np.array([0.0, 1.0]),
        g=_lower_triangle(2, [[-2 / GAMMA_ROS2]]),
        powers=np.array([0.5, 0.5]),
        implicit_coefficient=GAMMA_ROS2,
        ahead=0.0,
        onset=ONSET_STEPS,
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
