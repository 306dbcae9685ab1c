"""Methods of time integration, by name in `METHODS`: coefficients for the kernels, and properties.

The equations are on the page "Time integration" of the theory.

Explicit Runge-Kutta methods of fixed step: ode4, used by Giraudo et al. (2025), and lower orders, which they rule out.
The names are those of Simulink: ode1 Euler, ode2 Heun, ode3 Bogacki & Shampine (1989), ode4 the classical method
(Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, 1993, sect. II.1). For decay without oscillation,
their steps are stable up to 2, 2, 2.51 and 2.79 over the largest rate of decay; friction chatters at longer steps.

The other methods take friction and contact damping implicitly, and contact stiffness explicitly. Their matrix J in
place of the Jacobian contains only the damping matrix of `damping_kernel`. Friction and damping do not limit the step.

- imex2 is of second order (Strang splitting; Hairer, Lubich & Wanner, Geometric Numerical Integration, 2006, sect.
  II.5). The forces are linearised about velocities predicted for the middle of the step: the velocity at its start plus
  half of the last step's change, which is zero in the first step of a run. Without this prediction, sliding would begin
  too late. The velocities follow by a two-stage Rosenbrock method (Verwer, Spee, Blom & Hundsdorfer, A second-order
  Rosenbrock method applied to photochemical dispersion problems, SIAM J. Sci. Comput. 20 (1999) 1456), which is
  L-stable for gamma = 1 +- 1/sqrt 2. Steps are stable up to 2 over the largest natural angular frequency of the
  contacts.
- imex1 is of first order: the linearised implicit Euler method for the velocities, then the symplectic Euler method for
  the positions (ibid., sect. I.1.2), with the same limit of the step as imex2. It is the cheapest and the most damped:
  slow sliding is accurate to first order only.

The observed order of the implicit methods is lower if points enter and leave contact. They average the force of such a
point over two steps, see `contact_columns`.
"""

import math
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray

FAMILIES = ("explicit", "leapfrog")  # a kernel for each family
RUNGE_KUTTA, LEAPFROG = range(2)
ONSET_STEPS = 2.0  # implicit methods average the force of a point that comes into contact; one step is noisier
GAMMA_IMEX2 = 1 - 1 / math.sqrt(2)  # the smaller root is more accurate; the linear equation contains no positions


class Method(NamedTuple):
    """Method of time integration with s stages, as kernels read it; `family`: index in `FAMILIES`.

    `a`, [s, s]: weights of earlier stages in a stage's state; `b`, [s]: weights of the stages in the result; `c`, [s]:
    times of the stages, in steps from the step's start; `implicit_coefficient`: gamma of imex2, 1 for imex1, 0 for
    explicit methods; `ahead`: share of the last step's change of velocities that imex2 adds to predict velocities;
    `onset`: number of steps over which the force of a point that comes into contact is averaged, 0 for none. In the
    recorded means of forces and powers, the stages of an explicit method have the weights `b`.

    imex1 and imex2, the family "leapfrog", evaluate forces once, at the time `c` of a step, and solve their linear
    equations ``len(b)`` times.
    """

    family: int
    a: FloatArray
    b: FloatArray
    c: FloatArray
    implicit_coefficient: float
    ahead: float
    onset: float

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the right-hand side in a step."""
        return len(self.c)

    @property
    def implicit(self) -> bool:
        """True if friction and damping are integrated implicitly."""
        return self.family != RUNGE_KUTTA


def explicit(a: list[list[float]], b: list[float]) -> Method:
    """Make an explicit Runge-Kutta method from its Butcher tableau: `a`, rows after the first, and `b`, the weights."""
    matrix = np.zeros((len(b), len(b)))
    matrix[np.tril_indices(len(b), -1)] = [weight for row in a for weight in row]
    return Method(RUNGE_KUTTA, matrix, np.array(b), matrix.sum(axis=1), 0.0, 0.0, 0.0)


def _leapfrog(b: list[float], before: float, gamma: float, ahead: float) -> Method:
    return Method(LEAPFROG, np.zeros((1, 1)), np.array(b), np.array([before]), gamma, ahead, ONSET_STEPS)


METHODS = {
    "ode1": explicit([], [1.0]),
    "ode2": explicit([[1.0]], [0.5, 0.5]),
    "ode3": explicit([[0.5], [0.0, 0.75]], [2 / 9, 3 / 9, 4 / 9]),
    "ode4": explicit([[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 2 / 6, 2 / 6, 1 / 6]),
    "imex1": _leapfrog([1.0], 0.0, 1.0, 0.0),
    "imex2": _leapfrog([1.5, 0.5], 0.5, GAMMA_IMEX2, 0.5),
}
SOLVERS = tuple(METHODS)
