"""Point clouds of the raceways (Giraudo et al. 2025, eqs 16 and 17), and the points that a roller can touch."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.scene import Defect

MOST_POINTS = 500_000  # in a circle
MAX_CANDIDATE_BYTES = 2e8  # candidate points of both races; the paper's scene has 200 kB


class Circle(NamedTuple):
    """Circle of race points: radius and height above the mid-plane [m], and the surface normal.

    The normal (`normal_radial`, `normal_axial`) points from the raceway to the rollers; the height is for row 1, z > 0.
    """

    radius_m: float
    height_m: float
    normal_radial: float
    normal_axial: float


def race_circle(geometry: SphericalRollerGeometry, p: float, *, inner: bool) -> Circle:
    """Compute a circle of points of the outer or `inner` raceway at p times the contact angle (eq. 17, corrected).

    The outer raceway is a sphere about the bearing's centre. On the inner raceway, the profile's radius times cos(p
    times the contact angle) is subtracted from the distance of the profile's centre from the shaft's axis; the paper's
    plus sign puts the inner race outside the outer.
    """
    radius, c, s = geometry.raceway_radius_m, math.cos(p * geometry.tilt_rad), math.sin(p * geometry.tilt_rad)
    if not inner:
        return Circle(radius * c, radius * s, -c, -s)
    return Circle(geometry.inner_centre_radial_m - radius * c, geometry.inner_centre_axial_m - radius * s, c, s)


class CirclePoints(NamedTuple):
    """Points of one circle of one row: angle [rad], displacement along the normal [m], share of stiffness and damping.

    In a defect, several points may replace an evenly spaced point: their `share` is then below 1. `cell`: number of the
    evenly spaced point that a point is or replaces.
    """

    angle: FloatArray
    lift: FloatArray
    share: FloatArray
    cell: IntArray


def circle_points(count: int, radius_m: float, defects: Sequence[Defect], zone_rad: float) -> CirclePoints:
    """Place `count` points evenly on a circle (eq. 16), displaced by `defects`, whose angles count from `zone_rad`."""
    cell = np.arange(count)
    points = CirclePoints(cell * 2 * math.pi / count, np.zeros(count), np.ones(count), cell)
    for defect in defects:
        middle = zone_rad + defect.angle_rad
        if defect.extent_m is None:
            first = round(middle / (2 * math.pi) * count - (defect.points - 1) / 2)
            moved = np.isin(points.cell, np.arange(first, first + defect.points) % count)
            points = points._replace(lift=points.lift + np.where(moved, defect.height_m, 0.0))
        else:
            points = _refined(points, count, middle, defect.extent_m / radius_m, defect.refinement)
            across = wrapped(points.angle - middle) * radius_m / defect.extent_m
            points = points._replace(lift=points.lift + np.where(np.abs(across) <= 0.5, defect.height_m, 0.0))
    return points


def wrapped(angle: FloatArray) -> FloatArray:
    """Wrap an angle to the range from -pi to pi [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _refined(points: CirclePoints, count: int, middle: float, extent_rad: float, times: int) -> CirclePoints:
    """Replace points in and beside a defect by `times` as many, each with 1 / `times` of stiffness and damping."""
    spacing = 2 * math.pi / count
    near = np.abs(wrapped(points.angle - middle)) <= extent_rad / 2 + spacing
    if np.count_nonzero(near) * times + len(near) > MOST_POINTS:
        raise ConfigurationError(
            f"a defect with refinement = {times} needs more than {MOST_POINTS} points on a circle; refine it less."
        )
    offsets = (np.arange(times) - (times - 1) / 2) * spacing / times
    repeated = (np.repeat(column[near], times) for column in (points.lift, points.share / times, points.cell))
    finer = ((points.angle[near, None] + offsets).ravel(), *repeated)
    kept = (column[~near] for column in points)
    return CirclePoints._make(np.concatenate(both) for both in zip(kept, finer, strict=True))


def candidate_windows(
    circles: Sequence[Circle], rows: Sequence[Sequence[CirclePoints]], count: int, half: int
) -> tuple[list[list[FloatArray]], IntArray, list[float]]:
    """Build a race's windows: lists of neighbouring points that a roller may touch at the same time.

    `rows`: points of the `circles`, for each row of rollers; `count`: points per circle; `half`: number of points in
    reach on either side of the nearest point. The first windows are for all places without defects: window ``c - 1``
    has c points of each circle; its middle point is the nearest to the roller (odd c) or the last before it (even c).
    Each place near a defect has its own window. Returns the points of each circle in each window, [col.POINT_ROWS,
    points], in axes of the race at the middle point (for row 2, of the mirror image in row 1); the number of the window
    at each point, see `Races.window_of`; and the largest height of the defects in each window [m].
    """
    if 2 * half >= count:
        reach = f"a roller could touch {2 * half + 1} points of a circle, which has only {count} points"
        raise ConfigurationError(f"{reach}: use lower defects or a larger bearing.")
    wide = np.arange(-half, half + 1)
    # numbers of points that a defect moves or splits in several, then of all points near them
    marked = [np.unique(np.concatenate([c.cell[(c.lift != 0) | (c.share != 1)] for c in row])) for row in rows]
    special = [np.unique((cells[:, None] + wide) % count) for cells in marked]
    finest = max(1 / float(c.share.min()) for row in rows for c in row)
    needed = 2.0 * (len(wide) + sum(map(len, special))) * 8 * col.POINT_ROWS * len(circles) * len(wide) * finest
    if needed > MAX_CANDIDATE_BYTES:
        raise ConfigurationError(
            f"the tables of contact points, with {count} points per circle and refinement = {finest:.4g} of defects, "
            f"need {needed / 1e6:.4g} MB of memory; the limit is {MAX_CANDIDATE_BYTES / 1e6:g} MB. "
            "Use fewer points per circle, or smaller or less refined defects."
        )
    plain = [circle_points(count, c.radius_m, (), 0.0) for c in circles]
    found = [_window(circles, plain, 0, np.arange(c) - (c - 1) // 2, count) for c in range(1, len(wide) + 1)]
    highest = [0.0] * len(found)
    window_of = np.full((2, count), len(wide) - 1)
    for row, points in enumerate(rows):
        for nearest in special[row]:
            window_of[row, nearest] = len(found)
            found.append(_window(circles, points, int(nearest), wide, count))
            near = (np.isin(circle.cell, (nearest + wide) % count) for circle in points)
            highest.append(max(0.0, *(float(c.lift[own].max()) for c, own in zip(points, near, strict=True))))
    return found, window_of, highest


def _window(
    circles: Sequence[Circle], points: Sequence[CirclePoints], nearest: int, offsets: IntArray, count: int
) -> list[FloatArray]:
    """Build a window (list) of points: on each circle, numbers `nearest` + `offsets`; [col.POINT_ROWS, points]."""
    columns = []
    for circle, own in zip(circles, points, strict=True):
        near = np.flatnonzero(np.isin(own.cell, (nearest + offsets) % count))
        near = near[np.argsort(wrapped(own.angle[near] - nearest * 2 * math.pi / count))]
        angle = wrapped(own.angle[near] - nearest * 2 * math.pi / count)
        lift, c, s = own.lift[near], np.cos(angle), np.sin(angle)
        radius = circle.radius_m + lift * circle.normal_radial
        height = circle.height_m + lift * circle.normal_axial + 0 * c
        normal = (circle.normal_radial * c, circle.normal_radial * s, circle.normal_axial + 0 * c)
        columns.append(np.array([radius * c, radius * s, height, own.share[near], *normal]))
    return columns
