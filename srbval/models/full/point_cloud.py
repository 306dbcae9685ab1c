"""The raceways as point clouds (paper, eqs 16 and 17), and which of their points a roller can touch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import SphericalRollerGeometry
from srbval.bearing.geometry import CIRCLES
from srbval.scene import Defect

FloatArray = NDArray[np.float64]

LANES = 8  # candidate lists are padded to a multiple of this, so that vector code needs no remainder loop
DEEPEST_M = 2e-4  # penetration within which every touching point is among the candidates; checked in each run
FAR_M = 1e3  # where padding points lie: out of everybody's reach


@dataclass(frozen=True, kw_only=True)
class Circle:
    """One circle of points: radius and height above the mid-plane [m], and the surface normal there.

    The normal (`normal_radial`, `normal_axial`) points off the raceway, towards the rollers; the height is
    that of row 1 (z > 0).
    """

    radius_m: float
    height_m: float
    normal_radial: float
    normal_axial: float


def outer_circle(geometry: SphericalRollerGeometry, p: float) -> Circle:
    """Circle p of the outer raceway, eq. (17): on a sphere about the bearing centre."""
    c, s = math.cos(p * geometry.tilt_rad), math.sin(p * geometry.tilt_rad)
    return Circle(
        radius_m=geometry.raceway_radius_m * c,
        height_m=geometry.raceway_radius_m * s,
        normal_radial=-c,
        normal_axial=-s,
    )


def inner_circle(geometry: SphericalRollerGeometry, p: float) -> Circle:
    """Circle p of the inner raceway, eq. (17) with its sign mended: radius C_x **minus** R_x cos(p alpha).

    As printed, with a plus, the inner raceway would lie outside the outer one.
    """
    c, s = math.cos(p * geometry.tilt_rad), math.sin(p * geometry.tilt_rad)
    return Circle(
        radius_m=geometry.inner_centre_radial_m - geometry.raceway_radius_m * c,
        height_m=geometry.inner_centre_axial_m - geometry.raceway_radius_m * s,
        normal_radial=c,
        normal_axial=s,
    )


def displacement(points_per_circle: int, defect: Defect | None, zone_rad: float) -> FloatArray:
    """How far each point is moved along its normal [m], shape [2 rows, 3 circles, points].

    The defect's points are the `defect.points` ones nearest to its angle, counted from `zone_rad`.
    """
    moved = np.zeros((2, len(CIRCLES), points_per_circle))
    if defect is not None:
        middle = (zone_rad + defect.angle_rad) / (2 * math.pi) * points_per_circle
        first = round(middle - (defect.points - 1) / 2)
        index = np.arange(first, first + defect.points) % points_per_circle
        moved[defect.row - 1, defect.circle - 1, index] = defect.height_m
    return moved


def window_half_count(roller_radius_m: float, race_radius_m: float, *, points_per_circle: int, highest_m: float) -> int:
    """How many points either side of the nearest one a roller can touch.

    A point at distance x along the race stands x^2/2 (1/r + 1/R) clear of a roller that just touches the
    race (parallel-axis circles; R negative for the outer, concave race), so no point beyond
    x = sqrt(2 (d + h) / (1/r + 1/R)) is touched at penetrations up to d = `DEEPEST_M`, heights up to h.
    """
    reach = math.sqrt(2 * (DEEPEST_M + highest_m) / (1 / roller_radius_m + 1 / race_radius_m))
    spacing = 2 * math.pi * abs(race_radius_m) / points_per_circle
    return max(1, math.floor(reach / spacing + 0.5))


def candidate_windows(
    circles: list[Circle], moved: FloatArray, half_count: int
) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """The candidate points about each point of a race, in the frame of that point's meridian.

    `moved` is the displacement along the normal, shape [2 rows, 3 circles, points] [m]. Returns `windows`,
    shape [W, 3, lanes]: positions along the meridian, along the race and along the shaft [m], padded with
    points `FAR_M` away; `window_of`, shape [2, points]: which window belongs to a nearest point, all undisplaced
    points of a row sharing one; and `highest`, shape [W]: the highest displacement in each window [m].
    """
    count = moved.shape[2]
    offsets = np.arange(-half_count, half_count + 1)
    window_of = np.zeros((2, count), dtype=np.int64)
    windows: list[FloatArray] = []
    highest: list[float] = []
    for row in range(2):
        window_of[row] = len(windows)
        windows.append(_window(circles, np.zeros((len(circles), len(offsets))), row, count))
        highest.append(0.0)
        displaced = np.flatnonzero(np.any(moved[row] != 0, axis=0))
        for nearest in np.unique((displaced[:, None] + offsets) % count):
            window_of[row, nearest] = len(windows)
            height = moved[row][:, (nearest + offsets) % count]
            windows.append(_window(circles, height, row, count))
            highest.append(max(0.0, float(height.max())))
    return np.array(windows), window_of, np.array(highest)


def _window(circles: list[Circle], height: FloatArray, row: int, count: int) -> FloatArray:
    """One window, [3, lanes]; `height` shape [circles, offsets] [m]. Row 2 is row 1 mirrored at the mid-plane."""
    half = height.shape[1] // 2
    angle = np.arange(-half, half + 1) * 2 * math.pi / count
    lanes = -(-height.size // LANES) * LANES
    window = np.zeros((3, lanes))
    window[0] = FAR_M
    for i, circle in enumerate(circles):
        part = slice(i * len(angle), (i + 1) * len(angle))
        radius = circle.radius_m + height[i] * circle.normal_radial
        window[0, part] = radius * np.cos(angle)
        window[1, part] = radius * np.sin(angle)
        window[2, part] = (1 - 2 * row) * (circle.height_m + height[i] * circle.normal_axial)
    return window
