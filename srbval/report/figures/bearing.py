"""The bearing as the model has it: a section, the points about a defect, the scene along the shaft, the load zone."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import SphericalRollerGeometry
from srbval.models.full.point_cloud import Circle as PointCircle
from srbval.report.figures.style import (
    BLUE,
    INK,
    ORANGE,
    SOFT,
    VERMILION,
    WIDE,
    Drawn,
    legend_above,
    new_axes,
    new_figure,
    panel,
)
from srbval.report.findings.bearing_views import BearingViews, LoadZone
from srbval.scene import Scene

SECTION_INCHES, CLOUD_INCHES, SCENE_INCHES = (7.6, 3.1), (7.6, 2.7), (4.2, 3.9)
NEAR_MM = 22.0  # shown either side of a defect
SENSOR_RAD = np.pi / 4
Circles = Mapping[tuple[str, float], PointCircle]  # see `BearingViews`
STRETCH_DEG = 12.0
LIGHT = "#a9cfe6"
LOADED = 0.25  # of the largest mean force: what counts as the load zone
RATTLING = 0.02  # the same, of the place opposite: rollers that have no load to carry knock


def _roller_radius(geometry: SphericalRollerGeometry, along_m: FloatArray) -> FloatArray:
    """Radius, at a distance from its middle along its axis, of the barrel that just touches both raceways [m]."""
    profile, radius = geometry.raceway_radius_m, geometry.zero_play_diameter_m / 2
    return np.asarray(np.sqrt(profile**2 - along_m**2) - (profile - radius))


@panel
def axial_section(geometry: SphericalRollerGeometry, circles: Circles) -> Drawn:
    """The paper's Figure 1: upper half of a section in the shaft's plane, with the circles of contact points."""
    figure, axes = new_axes(SECTION_INCHES)
    for side in (1, -1):
        _draw_row(axes, geometry, circles, side)
    _draw_dimensions(axes, geometry)
    outer = geometry.outer_diameter_m / 2 * 1e3
    axes.set(aspect="equal", xlabel="Along the shaft, mm", ylabel="From the shaft's axis, mm",
             xlim=(-112, 168), ylim=(92, outer + 6))  # fmt: skip
    raceways, numbers = zip(*circles, strict=True)
    places = {key: [getattr(circle, key) for circle in circles.values()] for key in ("radius_m", "height_m")}
    return figure, {"raceway": raceways, "circle": numbers} | places


def _draw_row(axes: Any, geometry: SphericalRollerGeometry, circles: Circles, side: int) -> None:
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
    for (race, _), circle in circles.items():
        colour = VERMILION if race == "outer" else ORANGE
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
        (158, f"roller: ⌀ {diameter_mm:.2f} mm, {length_mm:g} mm long", INK),
        (140, "dots: circles of contact points,", VERMILION),
        (132, "three on either raceway of a row", VERMILION),
        (114, "inner raceway: arc of radius R$_x$", ORANGE),
    )
    for height, text, colour in lines:
        axes.text(62, height, text, **notes | {"color": colour}, zorder=6, bbox=white)


@panel
def defect_cloud(views: BearingViews) -> Drawn:
    """The paper's Figure 5: the points of one row of a raceway about its defect, seen flat and from the side."""
    figure = new_figure(CLOUD_INCHES)
    flat, side = figure.subplots(1, 2)
    columns: dict[str, list[float]] = {"circle": [], "along_mm": [], "lift_mm": []}
    for row, (circle, (along_m, lift_m)) in enumerate(views.defect.items()):
        near = np.abs(along_m) <= NEAR_MM / 1e3
        along, lift = along_m[near] * 1e3, lift_m[near] * 1e3
        lifted = lift != 0
        flat.plot(along, np.full(along.size, row), "o", color=BLUE, ms=4)
        flat.plot(along[lifted], np.full(int(lifted.sum()), row), "o", color=VERMILION, ms=7, zorder=4)
        if lifted.any():
            side.plot(along, lift, "-o", color=SOFT, mfc=BLUE, mec=BLUE, ms=4, lw=0.8)
            side.plot(along[lifted], lift[lifted], "o", color=VERMILION, ms=7, zorder=4)
        for name, values in zip(columns, ([circle] * along.size, along.tolist(), lift.tolist()), strict=True):
            columns[name] += values
    rows = len(views.defect)
    flat.set_yticks(range(rows), labels=[f"p = {circle:g}" for circle in views.defect])
    flat.set(xlabel="Along the race, mm", ylabel="Circle", ylim=(-0.6, rows - 0.4), title="Seen flat")
    side.set(xlabel="Along the race, mm", ylabel="Raised by, mm", title="Circle with the defect, from the side")
    return figure, columns


@panel
def bearing_scene(scene: Scene, geometry: SphericalRollerGeometry, zone: LoadZone) -> Drawn:
    """One row of rollers of `scene`, whose defect is in the outer race.

    Angles are counter-clockwise from the right; the load pushes the outer ring, so that the load zone lies opposite.
    Rollers are the darker the more of the load they carry in the mean of `zone`, whose loaded part is marked.
    """
    load, rollers, outer_mm = scene.load, geometry.rollers_per_row, geometry.outer_diameter_m / 2 * 1e3
    angles = 2 * np.pi * np.arange(rollers) / rollers
    centres = geometry.pitch_radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    half_m, reach = geometry.roller_diameter_m / 2, 1.42 * outer_mm
    race_mm, inner_mm = (geometry.pitch_radius_m + half_m) * 1e3, (geometry.pitch_radius_m - half_m) * 1e3
    figure, axes = new_axes(SCENE_INCHES)
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="mm", ylabel="mm")
    _draw_rings(axes, outer_mm, race_mm, inner_mm)
    off = np.degrees(np.angle(np.exp(1j * (angles - load.zone_rad))))
    middles, force = _means(zone.angle_deg, zone.outer_n)
    carried = np.interp(off, middles, force, period=360.0) / force.max()
    _draw_rollers(axes, centres * 1e3, geometry.roller_diameter_m * 1e3, carried)
    _draw_zone(axes, (race_mm, outer_mm), np.degrees(load.zone_rad), _half_zone_deg(middles, force))
    _draw_load(axes, load.direction_rad, outer_mm, f"{load.radial_n / 1e3:g} kN")
    _draw_defect(axes, race_mm, load.zone_rad + scene.defect.angle_rad)
    sensor = 1.05 * outer_mm * np.array([np.cos(SENSOR_RAD), np.sin(SENSOR_RAD)])
    axes.plot(*sensor, marker="s", ms=8, mfc=INK, mec="white", zorder=8)
    axes.annotate("sensor", sensor, xytext=(7, 5), textcoords="offset points", fontsize=8, zorder=9)
    axes.set_title("One row, seen along the shaft", parse_math=False)
    return figure, {"roller": np.arange(rollers), "x_m": centres[:, 0], "y_m": centres[:, 1]}


def _draw_rings(axes: Any, outer: float, race: float, inner: float) -> None:
    from matplotlib.patches import Annulus, Circle

    axes.add_patch(Annulus((0, 0), outer, outer - race, fc="#dfe5ec", ec=SOFT, lw=0.8))
    axes.add_patch(Annulus((0, 0), inner, 0.16 * inner, fc="#dfe5ec", ec=SOFT, lw=0.8))
    axes.add_patch(Circle((0, 0), 0.84 * inner, fc="#f3f5f8", ec=SOFT, lw=0.8))


def _draw_rollers(axes: Any, centres_mm: FloatArray, diameter_mm: float, carried: FloatArray) -> None:
    """Rollers, from white without load to blue for the most loaded one."""
    from matplotlib import colormaps
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    circles = [Circle((x, y), diameter_mm / 2) for x, y in centres_mm]
    faces = colormaps["Blues"](0.75 * carried)
    axes.add_collection(PatchCollection(circles, edgecolor=INK, linewidth=0.7, facecolor=faces, zorder=4))


def _draw_zone(axes: Any, ring_mm: tuple[float, float], middle_deg: float, half_deg: float) -> None:
    """The loaded part of the outer race, as an arc over it with its name beside its end."""
    from matplotlib.patches import Wedge

    inner, outer = ring_mm
    ends, at = (middle_deg - half_deg, middle_deg + half_deg), np.radians(middle_deg + half_deg / 2)
    axes.add_patch(Wedge((0, 0), inner + 0.3 * (outer - inner), *ends, width=0.3 * (outer - inner), fc=BLUE, ec="none"))
    axes.annotate(
        f"load zone,\n± {half_deg:.0f}°", (outer * np.cos(at), outer * np.sin(at)), xytext=(0.02, 0.98),
        textcoords="axes fraction", ha="left", va="top", color=BLUE, fontsize=8, zorder=9,
        arrowprops={"arrowstyle": "-", "color": BLUE, "lw": 0.8},
    )  # fmt: skip


def _draw_load(axes: Any, angle: float, outer_mm: float, text: str) -> None:
    """An arrow that pushes the outer ring along `angle`."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    arrow = {"arrowstyle": "-|>", "color": BLUE, "lw": 2.6, "mutation_scale": 16}
    axes.annotate("", xy=-1.02 * direction * outer_mm, xytext=-1.34 * direction * outer_mm, arrowprops=arrow, zorder=6)
    x, y = -1.2 * direction * outer_mm - 0.06 * outer_mm * np.array([abs(direction[1]), abs(direction[0])])
    side = {"ha": "right", "va": "center"} if abs(direction[1]) > abs(direction[0]) else {"ha": "center", "va": "top"}
    axes.text(x, y, text, color=BLUE, fontweight="bold", parse_math=False, **side)


def _draw_defect(axes: Any, radius_mm: float, angle: float) -> None:
    at = radius_mm * np.array([np.cos(angle), np.sin(angle)])
    axes.plot(*at, marker="*", ms=13, mfc=VERMILION, mec="white", mew=0.8, ls="none", zorder=8)
    right, top = bool(at[0] > 0), bool(at[1] > 0)
    axes.annotate(
        "outer-race defect", at, xytext=(0.98 if right else 0.02, 0.98 if top else 0.02), textcoords="axes fraction",
        ha="right" if right else "left", va="top" if top else "bottom", color=VERMILION, fontsize=8, zorder=9,
        arrowprops={"arrowstyle": "-", "color": VERMILION, "lw": 0.8, "shrinkB": 5},
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1},
    )  # fmt: skip


@panel
def load_zone(zone: LoadZone) -> Drawn:
    """The force of every roller on either race at every moment kept."""
    order = np.argsort(zone.angle_deg)
    angle, outer, inner = zone.angle_deg[order], zone.outer_n[order] / 1e3, zone.inner_n[order] / 1e3
    figure, axes = new_axes(WIDE)
    middles, means = _means(angle, outer)
    axes.plot(angle, outer, ".", color=LIGHT, ms=1.5, label="one roller, one moment", rasterized=True)
    axes.plot(middles, means, "-o", color=BLUE, ms=3, label="mean, outer race")
    axes.plot(middles, _means(angle, inner)[1], "--", color=VERMILION, label="mean, inner race")
    axes.axvline(0, color=SOFT, lw=0.8, ls="--")
    axes.set(xlabel="Roller's angle from the middle of the load zone, degrees", ylabel="Contact force, kN",
             xlim=(-180, 180), xticks=range(-180, 181, 60))  # fmt: skip
    top = 1.1 * float(np.quantile(outer, 0.995))
    axes.set_ylim(0, top)
    if above := int(np.count_nonzero(outer > top)):
        axes.text(0.99, 0.97, f"{above} of {outer.size} above", transform=axes.transAxes, ha="right", va="top",
                  fontsize=7, color=SOFT)  # fmt: skip
    if zone.far_n > RATTLING * zone.near_n:
        for place in (-150, 150):
            axes.text(place, 0.6, "unloaded:\nrollers rattle", transform=axes.get_xaxis_transform(), ha="center",
                      fontsize=8, color=VERMILION)  # fmt: skip
    legend_above(axes)
    return figure, {"angle_deg": angle, "outer_race_n": 1e3 * outer, "inner_race_n": 1e3 * inner}


def _half_zone_deg(middles: FloatArray, force: FloatArray) -> float:
    """How far from its middle the load zone reaches: to where the mean of both sides first falls below `LOADED`."""
    both = (force + force[::-1])[middles > 0]
    below = both < LOADED * both.max()
    return float(STRETCH_DEG * (below.argmax() if below.any() else below.size))


def _means(angle: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middles of stretches of `STRETCH_DEG` and the mean force in each."""
    edges = np.arange(-180.0, 180.0 + STRETCH_DEG, STRETCH_DEG)
    count, _ = np.histogram(angle, edges)
    total, _ = np.histogram(angle, edges, weights=force)
    return (edges[:-1] + edges[1:]) / 2, total / np.maximum(count, 1)
