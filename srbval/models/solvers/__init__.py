"""Time integration, one family a file; `METHODS` maps the names a scene may use."""

from srbval.models.solvers.implicit_leapfrog import IMEX1, IMEX2
from srbval.models.solvers.method import Coefficients, Method
from srbval.models.solvers.runge_kutta import ODE1, ODE2, ODE3, ODE4
from srbval.models.solvers.w_method import ROS2

__all__ = ["METHODS", "SOLVERS", "Coefficients", "Method"]

METHODS = {method.name: method for method in (ODE1, ODE2, ODE3, ODE4, IMEX1, IMEX2, ROS2)}
SOLVERS = tuple(METHODS)
