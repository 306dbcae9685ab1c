"""The bearing seen along the shaft (rollers, load, load zone, defect, sensor), and which rollers carry the load."""

from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import SphericalRollerGeometry
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, INK, SOFT, VERMILION, WIDE, figure_style, legend_above, new_axes
from srbval.report.findings.bearing_views import LoadZone
from srbval.scene import Scene

SIZE_INCHES = (4.2, 3.9)
SENSOR_RAD = np.pi / 4
STRETCH_DEG = 12.0
LIGHT = "#a9cfe6"
LOADED = 0.25  # of the largest mean force: what counts as the load zone
RATTLING = 0.02  # the same, of the place opposite: rollers that have no load to carry knock


def bearing_scene(
    folder: Path, name: str, *, scene: Scene, geometry: SphericalRollerGeometry, zone: LoadZone
) -> PanelFiles:
    """Draw one row of rollers of `scene`, whose defect is in the outer race; write picture and CSV.

    Angles are counter-clockwise from the right; the load pushes the outer ring, so that the load zone lies opposite.
    Rollers are the darker the more of the load they carry in the mean of `zone`, whose loaded part is marked.
    """
    load, rollers, outer_mm = scene.load, geometry.rollers_per_row, geometry.outer_diameter_m / 2 * 1e3
    angles = 2 * np.pi * np.arange(rollers) / rollers
    centres = geometry.pitch_radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    half_m, reach = geometry.roller_diameter_m / 2, 1.42 * outer_mm
    race_mm, inner_mm = (geometry.pitch_radius_m + half_m) * 1e3, (geometry.pitch_radius_m - half_m) * 1e3
    with figure_style():
        figure, axes = new_axes(SIZE_INCHES)
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="mm", ylabel="mm")
        _draw_rings(axes, outer_mm, race_mm, inner_mm)
        off = np.degrees(np.angle(np.exp(1j * (angles - load.zone_rad))))
        middles, force = _means(zone.angle_deg, zone.outer_n)
        carried = np.interp(off, middles, force, period=360.0) / force.max()
        _draw_rollers(axes, centres * 1e3, geometry.roller_diameter_m * 1e3, carried)
        _draw_zone(axes, (race_mm, outer_mm), np.degrees(load.zone_rad), _half_zone_deg(middles, force))
        _draw_load(axes, load.direction_rad, outer_mm, f"{load.radial_n / 1e3:g} kN")
        _draw_defect(axes, race_mm, load.zone_rad + scene.defect.angle_rad)
        _draw_sensor(axes, SENSOR_RAD, outer_mm)
        axes.set_title("One row, seen along the shaft", parse_math=False)
        columns = {"roller": np.arange(rollers), "x_m": centres[:, 0], "y_m": centres[:, 1]}
        return save_panel(figure, folder, name, columns)


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


def _draw_sensor(axes: Any, angle: float, outer_mm: float) -> None:
    at = 1.05 * outer_mm * np.array([np.cos(angle), np.sin(angle)])
    axes.plot(*at, marker="s", ms=8, mfc=INK, mec="white", zorder=8)
    axes.annotate("sensor", at, xytext=(7, 5), textcoords="offset points", fontsize=8, zorder=9)


def load_zone(folder: Path, name: str, *, zone: LoadZone) -> PanelFiles:
    """Draw the force of every roller on either race at every moment kept; write picture and CSV."""
    order = np.argsort(zone.angle_deg)
    angle, outer, inner = zone.angle_deg[order], zone.outer_n[order] / 1e3, zone.inner_n[order] / 1e3
    with figure_style():
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
        columns = {"angle_deg": angle, "outer_race_n": 1e3 * outer, "inner_race_n": 1e3 * inner}
        return save_panel(figure, folder, name, columns)


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
