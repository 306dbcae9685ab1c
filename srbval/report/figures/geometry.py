"""The bearing as the model has it: a section along the shaft, its point clouds, and a look at all of it."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import SphericalRollerGeometry
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, INK, ORANGE, SOFT, VERMILION, figure_style, new_figure
from srbval.report.findings.bearing_views import DEFECT_CIRCLE, DefectPoints, RacewayCircle

SECTION_INCHES, CLOUD_INCHES, SCENE_INCHES = (7.6, 3.1), (7.6, 2.7), (4.2, 3.9)
PIXELS_PER_INCH = 130  # of the three-dimensional picture
NEAR_MM = 22.0  # shown either side of a defect
CIRCLE_COLUMNS = ("raceway", "circle", "radius_m", "height_m")
ROLLER_LINES = (13, 9)  # of a drawn roller's surface, around and along


def _roller_radius(geometry: SphericalRollerGeometry, along_m: FloatArray) -> FloatArray:
    """Radius, at a distance from its middle along its axis, of the barrel that just touches both raceways [m]."""
    profile, radius = geometry.raceway_radius_m, geometry.zero_play_diameter_m / 2
    return np.asarray(np.sqrt(profile**2 - along_m**2) - (profile - radius))


def axial_section(
    folder: Path, name: str, *, geometry: SphericalRollerGeometry, circles: Sequence[RacewayCircle]
) -> PanelFiles:
    """The paper's Figure 1: upper half of a section in the shaft's plane; write picture and CSV (contact circles)."""
    with figure_style():
        figure, axes = _figure(SECTION_INCHES)
        for side in (1, -1):
            _draw_row(axes, geometry, circles, side)
        _draw_dimensions(axes, geometry)
        outer = geometry.outer_diameter_m / 2 * 1e3
        axes.set(aspect="equal", xlabel="Along the shaft, mm", ylabel="From the shaft's axis, mm",
                 xlim=(-112, 168), ylim=(92, outer + 6))  # fmt: skip
        return save_panel(figure, folder, name, {key: [getattr(c, key) for c in circles] for key in CIRCLE_COLUMNS})


def _draw_row(axes: Any, geometry: SphericalRollerGeometry, circles: Sequence[RacewayCircle], side: int) -> None:
    """Races and roller of the row at `side` (1: right) of the middle."""
    alpha, raceway = geometry.tilt_rad, geometry.raceway_radius_m
    reach = np.linspace(0.0, min(1.9 * alpha, math.asin(geometry.width_m / 2 / raceway)), 60)
    outer_z, outer_r = raceway * np.sin(reach), raceway * np.cos(reach)
    top, half = geometry.outer_diameter_m / 2, geometry.width_m / 2
    ring_z, ring_r = [0.0, *outer_z, half, half, 0.0], [outer_r[0], *outer_r, outer_r[-1], top, top]
    axes.fill(side * np.array(ring_z) * 1e3, np.array(ring_r) * 1e3, fc="#dfe5ec", ec=SOFT, lw=0.8)
    inner = geometry.inner_centre_radial_m - raceway * np.cos(reach)
    inner_z = geometry.inner_centre_axial_m - raceway * np.sin(reach)
    axes.fill(side * np.array([inner_z[0], *inner_z, inner_z[-1], half, half]) * 1e3,
              np.array([0.09, *inner, 0.09, 0.09, inner[0]]) * 1e3, fc="#e9edf2", ec="none")  # fmt: skip
    axes.plot(side * inner_z * 1e3, inner * 1e3, color=SOFT, lw=0.8)
    z, r = _outline(geometry)
    axes.fill(side * z * 1e3, r * 1e3, fc="#cfe3f2", ec=INK, lw=1.0, zorder=3)
    for circle in circles:
        colour = VERMILION if circle.raceway == "outer" else ORANGE
        axes.plot(side * circle.height_m * 1e3, circle.radius_m * 1e3, "o", color=colour, ms=4, zorder=5)


def _outline(geometry: SphericalRollerGeometry) -> tuple[FloatArray, FloatArray]:
    """Outline of a roller in the section: along the shaft, from the axis [m]."""
    c, s, half_width = math.cos(geometry.tilt_rad), math.sin(geometry.tilt_rad), geometry.roller_width_m / 2
    along = np.linspace(-half_width, half_width, 41)
    across = _roller_radius(geometry, along)
    along, across = np.concatenate([along, along[::-1]]), np.concatenate([across, -across[::-1]])
    middle = geometry.roller_centre_distance_m
    return middle * s + across * s + along * c, middle * c + across * c - along * s


def _draw_dimensions(axes: Any, geometry: SphericalRollerGeometry) -> None:
    alpha, distance = geometry.tilt_rad, geometry.roller_centre_distance_m * 1e3
    at = np.array([distance * math.sin(alpha), distance * math.cos(alpha)])
    axes.plot([0, at[0]], [0, at[1]], color=BLUE, lw=0.8, ls="--", zorder=4)
    axes.axvline(0, color=BLUE, lw=0.6, ls="-.")
    axes.plot([-74, at[0]], [at[1]] * 2, color=BLUE, lw=0.7, ls=":", zorder=4)
    looks = {"color": BLUE, "fontsize": 8, "zorder": 6}
    white = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1}
    axes.text(-76, at[1], f"pitch radius d$_p$\n{geometry.pitch_radius_m * 1e3:.2f} mm", ha="right", va="center",
              bbox=white, **looks)  # fmt: skip
    axes.text(3, 97, f"tilt α = {math.degrees(alpha):.2f}°", ha="left", va="center", bbox=white, **looks)
    diameter_mm, length_mm = 1e3 * geometry.zero_play_diameter_m, 1e3 * geometry.roller_width_m
    notes = {"fontsize": 8, "va": "center", "ha": "left", "color": INK}
    lines = (
        (176, f"outer raceway: sphere of radius R$_x$ = {geometry.raceway_radius_m * 1e3:g} mm", VERMILION),
        (
            158,
            f"roller: ⌀ {diameter_mm:.2f} mm, {length_mm:g} mm long",
            INK,
        ),
        (140, "dots: circles of contact points,", VERMILION),
        (132, "three on either raceway of a row", VERMILION),
        (114, "inner raceway: arc of radius R$_x$", ORANGE),
    )
    for height, text, colour in lines:
        axes.text(62, height, text, **notes | {"color": colour}, zorder=6, bbox=white)


def defect_cloud(folder: Path, name: str, *, points: Sequence[DefectPoints]) -> PanelFiles:
    """The paper's Figure 5: the points of one row of a raceway about its defect, seen flat and from the side.

    `points` of each circle; write picture and CSV.
    """
    with figure_style():
        figure, (flat, side) = _figure(CLOUD_INCHES, 2)
        columns: dict[str, list[float]] = {"circle": [], "along_mm": [], "lift_mm": []}
        for row, own in enumerate(points):
            near = np.abs(own.along_m) <= NEAR_MM / 1e3
            along, lift = own.along_m[near] * 1e3, own.lift_m[near] * 1e3
            lifted = lift != 0
            flat.plot(along, np.full(along.size, row), "o", color=BLUE, ms=4)
            flat.plot(along[lifted], np.full(int(lifted.sum()), row), "o", color=VERMILION, ms=7, zorder=4)
            if lifted.any():
                side.plot(along, lift, "-o", color=SOFT, mfc=BLUE, mec=BLUE, ms=4, lw=0.8)
                side.plot(along[lifted], lift[lifted], "o", color=VERMILION, ms=7, zorder=4)
            columns["circle"] += [own.circle] * along.size
            columns["along_mm"] += along.tolist()
            columns["lift_mm"] += lift.tolist()
        flat.set_yticks(range(len(points)), labels=[f"p = {own.circle:g}" for own in points])
        flat.set(xlabel="Along the race, mm", ylabel="Circle", ylim=(-0.6, len(points) - 0.4), title="Seen flat")
        side.set(xlabel="Along the race, mm", ylabel="Raised by, mm", title="Circle with the defect, from the side")
        return save_panel(figure, folder, name, columns)


def whole_bearing(
    folder: Path,
    name: str,
    *,
    geometry: SphericalRollerGeometry,
    circles: Sequence[RacewayCircle],
    slot_angle_rad: FloatArray,
    defect_rad: float,
) -> PanelFiles:
    """The paper's Figure 8: point clouds of both raceways and all rollers, in three dimensions; picture (PNG) and CSV.

    `slot_angle_rad`, [2 M], row 1 first; `defect_rad`: where the outer race's middle circle of row 1 is raised.
    """
    with figure_style():
        from mpl_toolkits.mplot3d import Axes3D  # noqa: F401  (registers the projection)

        figure, axes = _figure(SCENE_INCHES, projection="3d")
        for sign, angles in zip((1, -1), np.split(slot_angle_rad, 2), strict=True):
            for angle in angles:
                axes.plot_surface(*_surface(geometry, angle, sign), color="#9cc7e6", lw=0, alpha=0.9, shade=True)
            _scatter(axes, circles, sign)
        circle = next(c for c in circles if (c.raceway, c.circle) == ("outer", DEFECT_CIRCLE))
        at = np.array([circle.radius_m * math.cos(defect_rad), circle.radius_m * math.sin(defect_rad)]) * 1e3
        axes.plot([at[0]], [circle.height_m * 1e3], [at[1]], "*", color=VERMILION, ms=14, mec="white", zorder=99)
        axes.set(xlim=(-150, 150), ylim=(-150, 150), zlim=(-150, 150))
        axes.set_axis_off()
        axes.set_box_aspect((1, 1, 1), zoom=1.32)
        axes.view_init(elev=18, azim=-58)
        figure.set_dpi(PIXELS_PER_INCH)
        columns = {"row": np.repeat([1, 2], len(slot_angle_rad) // 2), "slot_angle_rad": slot_angle_rad}
        return save_panel(figure, folder, name, columns, suffix=".png")


def _surface(geometry: SphericalRollerGeometry, angle: float, sign: int) -> tuple[FloatArray, ...]:
    """A roller's surface [mm]: x to the right, the shaft along y, z up."""
    c, s, half_width = math.cos(geometry.tilt_rad), math.sin(geometry.tilt_rad), geometry.roller_width_m / 2
    turn, along = np.meshgrid(
        np.linspace(0, 2 * np.pi, ROLLER_LINES[0]), np.linspace(-1, 1, ROLLER_LINES[1]) * half_width
    )
    radius = _roller_radius(geometry, along)
    across, sideways = radius * np.cos(turn), radius * np.sin(turn)
    middle = geometry.roller_centre_distance_m
    radial, axial = (middle + across) * c - along * s, sign * ((middle + across) * s + along * c)
    x = radial * math.cos(angle) - sideways * math.sin(angle)
    z = radial * math.sin(angle) + sideways * math.cos(angle)
    return x * 1e3, axial * 1e3, z * 1e3


def _scatter(axes: Any, circles: Sequence[RacewayCircle], sign: int) -> None:
    turn = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    for circle in circles:
        colour = SOFT if circle.raceway == "outer" else ORANGE
        axes.scatter(circle.radius_m * np.cos(turn) * 1e3, np.full(turn.size, sign * circle.height_m * 1e3),
                     circle.radius_m * np.sin(turn) * 1e3, s=1.2, color=colour, depthshade=False)  # fmt: skip


def _figure(size: tuple[float, float], columns: int = 1, **looks: Any) -> tuple[Any, Any]:
    figure = new_figure(size)
    return figure, figure.subplots(1, columns, subplot_kw=looks)
