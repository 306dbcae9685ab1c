"""Time integration, one method a file; `SOLVERS` maps the names a scene may use."""

from srbval.models.solvers.runge_kutta import TABLEAUX, Tableau

__all__ = ["SOLVERS", "TABLEAUX", "Tableau"]

SOLVERS = tuple(TABLEAUX)
