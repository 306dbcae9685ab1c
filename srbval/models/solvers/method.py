"""A method of time integration: what the kernels need of it, and what a user should know."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray

RUNGE_KUTTA, ROSENBROCK, LEAPFROG = range(3)  # families, one kernel each
ONSET = 2.0  # implicit methods: neighbouring steps share a point's coming into contact; 1 leaves more noise


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
    """`order` of consistency, `evaluations` of the right-hand side in a step; `implicit`: friction and damping are."""

    name: str
    title: str
    order: int
    evaluations: int
    implicit: bool
    coefficients: Coefficients


def explicit(name: str, title: str, order: int, a: list[list[float]], b: list[float]) -> Method:
    """A Runge-Kutta method from the rows of its Butcher tableau after the first."""
    matrix = lower(len(b), a)
    weights = np.array(b)
    return Method(
        name=name, title=title, order=order, evaluations=len(b), implicit=False,
        coefficients=Coefficients(
            RUNGE_KUTTA, matrix, weights, matrix.sum(axis=1), np.zeros_like(matrix), weights, 0.0, 0.0, 0.0
        ),
    )  # fmt: skip


def lower(size: int, rows: list[list[float]]) -> FloatArray:
    """A strictly lower triangular matrix, [size, size], from its rows after the first."""
    matrix = np.zeros((size, size))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix
