"""Vectors and symmetric tensors in kernels: reading and writing them in a workspace or list, and their products."""

from typing import Any

import numpy as np

from srbval.models.full.columns import INERTIA_XX, INERTIA_XY, STRIDE
from srbval.models.jit import kernel_part

# Vectors are tuples of their components; in the workspace the three components have neighbouring rows.
Vector = tuple[float, float, float]
Vectors = tuple[Vector, Vector, Vector]
SECOND_ROW, THIRD_ROW = np.uint64(STRIDE), np.uint64(2 * STRIDE)


@kernel_part
def vector_at(space: Any, row: Any, j: Any) -> Vector:
    """Read the vector of column `j` whose first component is in `row` of the workspace."""
    return space[row + j], space[row + SECOND_ROW + j], space[row + THIRD_ROW + j]


@kernel_part
def point_at(table: Any, row: Any, i: Any) -> Vector:
    """Read the vector of entry `i` whose first component is in `row` of a list of points."""
    return table[row, i], table[row + 1, i], table[row + 2, i]


@kernel_part
def entries_from(values: Any, first: Any) -> Vector:
    """Read the vector whose first component is entry `first` of an array, such as a state or `totals`."""
    return values[first], values[first + 1], values[first + 2]


@kernel_part
def store_vector(space: Any, row: Any, j: Any, vector: Vector) -> None:
    """Write `vector` to column `j` of the workspace, its first component to `row`."""
    space[row + j], space[row + SECOND_ROW + j], space[row + THIRD_ROW + j] = vector


@kernel_part
def add_vector(space: Any, row: Any, j: Any, vector: Vector) -> None:
    """Add `vector` to the vector of column `j` whose first component is in `row` of the workspace."""
    store_vector(space, row, j, plus(vector_at(space, row, j), 1.0, vector))


@kernel_part
def axes_at(space: Any, row: Any, j: Any) -> Vectors:
    """Read three vectors of column `j`: axes x, y, z of a slot from row `X_WX`, axes of a race from row `A_X`."""
    after = THIRD_ROW + SECOND_ROW
    return vector_at(space, row, j), vector_at(space, row + after, j), vector_at(space, row + after + after, j)


@kernel_part
def dot(a: Vector, b: Vector) -> float:
    """Compute the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel_part
def cross(a: Vector, b: Vector) -> Vector:
    """Compute the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel_part
def times(factor: float, a: Vector) -> Vector:
    """Compute the vector `factor` a."""
    return factor * a[0], factor * a[1], factor * a[2]


@kernel_part
def plus(a: Vector, factor: float, b: Vector) -> Vector:
    """Compute the vector a + `factor` b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@kernel_part
def plus_outer(rows: Vectors, a: Vector, b: Vector) -> Vectors:
    """Add the dyad a b to a matrix, given by its three `rows`."""
    return plus(rows[0], a[0], b), plus(rows[1], a[1], b), plus(rows[2], a[2], b)


@kernel_part
def to_world(vector: Vector, axes: Vectors) -> Vector:
    """Convert a vector's components along `axes` to world components."""
    return plus(plus(times(vector[0], axes[0]), vector[1], axes[1]), vector[2], axes[2])


@kernel_part
def along_axes(vector: Vector, axes: Vectors) -> Vector:
    """Compute the components of a vector along `axes`."""
    return dot(vector, axes[0]), dot(vector, axes[1]), dot(vector, axes[2])


# Symmetric tensors are tuples of their components xx, yy, zz, xy, xz, yz.
Tensor = tuple[float, float, float, float, float, float]


@kernel_part
def plus_dyad(tensor: Tensor, factor: float, a: Vector) -> Tensor:
    """Compute the symmetric tensor `tensor` + `factor` a a."""
    x, y, z = times(factor, a)
    return (
        tensor[0] + x * a[0],
        tensor[1] + y * a[1],
        tensor[2] + z * a[2],
        tensor[3] + x * a[1],
        tensor[4] + x * a[2],
        tensor[5] + y * a[2],
    )


@kernel_part
def tensor_times(tensor: Tensor, a: Vector) -> Vector:
    """Compute the product of a symmetric tensor and a vector."""
    xx, yy, zz, xy, xz, yz = tensor
    return dot((xx, xy, xz), a), dot((xy, yy, yz), a), dot((xz, yz, zz), a)


@kernel_part
def inertia_in(totals: Any) -> Tensor:
    """Read the inertia tensor of the cage with its rollers from the `totals` of an evaluation."""
    return entries_from(totals, INERTIA_XX) + entries_from(totals, INERTIA_XY)
