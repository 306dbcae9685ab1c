"""Time integration; `METHODS` maps the names a scene may use."""

from srbval.models.solvers.methods import METHODS, SOLVERS, Coefficients, Method

__all__ = ["METHODS", "SOLVERS", "Coefficients", "Method"]
