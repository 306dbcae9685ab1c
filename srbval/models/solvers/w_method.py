"""Second order, friction and damping implicit: a two-stage W-method.

Verwer, Spee, Blom & Hundsdorfer, A second-order Rosenbrock method applied to photochemical dispersion problems, SIAM
J. Sci. Comput. 20 (1999) 1456: with S = (1 - gamma h J)^-1

    k1 = S f(y),   k2 = S (f(y + h k1) - 2 k1),   y + h (3/2 k1 + 1/2 k2)

is of second order whatever stands for the Jacobian J, and L-stable in what J holds for gamma = 1 +- 1/sqrt 2 (the
larger one keeps all components positive). Here J holds the damping matrix of `damping_kernel` alone: friction and
contact damping set no limit to the step, contact stiffness does, as in Heun's method with the damping there is. J is
factored once and turns on with the slots' axes to the second stage, which changes it by the order of the step and so
leaves the method's. The stages are written for u = gamma h k, which needs no product with J (Hairer & Wanner, Solving
Ordinary Differential Equations II, 1996, sect. IV.7). No step control; points that enter and leave contact limit the
observed order.
"""

import math

import numpy as np

from srbval.models.solvers.method import ONSET, ROSENBROCK, Coefficients, Method, lower

GAMMA = 1 + 1 / math.sqrt(2)

ROS2 = Method(
    name="ros2",
    title="two-stage W-method, friction and damping implicit",
    order=2,
    evaluations=2,
    implicit=True,
    coefficients=Coefficients(
        ROSENBROCK,
        lower(2, [[1 / GAMMA]]),
        np.array([3, 1]) / (2 * GAMMA),
        np.array([0.0, 1.0]),
        lower(2, [[-2 / GAMMA]]),
        np.array([0.5, 0.5]),
        GAMMA,
        0.0,
        ONSET,
    ),
)
