"""Time integration; `METHODS` maps the names a scene may use."""

from srbval.models.solvers.methods import FAMILIES, METHODS, SOLVERS, Coefficients, Method
