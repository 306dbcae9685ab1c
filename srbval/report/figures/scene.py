"""The bearing seen along the shaft: rollers, load, load zone, defect, sensor."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, INK, SOFT, VERMILION, figure_style, new_figure

SIZE_INCHES = (4.2, 3.9)
DOWN = -np.pi / 2


def bearing_scene(
    folder: Path,
    name: str,
    *,
    pitch_radius_m: float,
    roller_diameter_m: float,
    rollers: int,
    outer_diameter_m: float,
    roller_load_n: ArrayLike | None = None,
    load_text: str = "",
    load_angle_rad: float = DOWN,
    defect: str = "",
    defect_angle_rad: float = DOWN,
    sensor_angle_rad: float | None = None,
    first_roller_rad: float = DOWN,
    title: str = "",
) -> PanelFiles:
    """Draw one row of rollers; write picture and CSV.

    Angles are counter-clockwise from the right [rad]; `load_angle_rad` is the direction in which the load pushes
    the outer ring, so that the load zone lies opposite. `roller_load_n`, shape [rollers], colours each roller by
    its contact force. `defect` is ``outer``, ``inner`` or empty; it is drawn on that raceway at `defect_angle_rad`.
    """
    if defect not in ("", "outer", "inner"):
        raise ValueError(f"defect {defect!r} is not outer, inner or empty.")
    angles = first_roller_rad + 2 * np.pi * np.arange(rollers) / rollers
    centres = pitch_radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    load = None if roller_load_n is None else np.asarray(roller_load_n, dtype=float)
    races = {"outer": pitch_radius_m + roller_diameter_m / 2, "inner": pitch_radius_m - roller_diameter_m / 2}
    with figure_style():
        figure, axes = _axes(outer_diameter_m / 2)
        _draw_rings(axes, outer_diameter_m / 2, races)
        _draw_rollers(figure, axes, centres * 1e3, roller_diameter_m * 1e3, load)
        _draw_load(axes, load_angle_rad, outer_diameter_m / 2 * 1e3, races["inner"] * 1e3, load_text)
        if defect:
            _draw_defect(axes, defect, races[defect] * 1e3, defect_angle_rad)
        if sensor_angle_rad is not None:
            _draw_sensor(axes, sensor_angle_rad, outer_diameter_m / 2 * 1e3)
        axes.set_title(title, parse_math=False)
        columns = {"roller": np.arange(rollers), "x_m": centres[:, 0], "y_m": centres[:, 1]}
        return save_panel(figure, folder, name, columns | ({} if load is None else {"load_n": load}))


def _axes(outer_radius_m: float) -> tuple[Any, Any]:
    figure = new_figure(SIZE_INCHES)
    axes = figure.add_subplot()
    reach = 1.42 * outer_radius_m * 1e3
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="mm", ylabel="mm")
    return figure, axes


def _draw_rings(axes: Any, outer_radius_m: float, races: dict[str, float]) -> None:
    from matplotlib.patches import Annulus, Circle

    outer, race, inner = outer_radius_m * 1e3, races["outer"] * 1e3, races["inner"] * 1e3
    axes.add_patch(Annulus((0, 0), outer, outer - race, fc="#dfe5ec", ec=SOFT, lw=0.8))
    axes.add_patch(Annulus((0, 0), inner, 0.16 * inner, fc="#dfe5ec", ec=SOFT, lw=0.8))
    axes.add_patch(Circle((0, 0), 0.84 * inner, fc="#f3f5f8", ec=SOFT, lw=0.8))


def _draw_rollers(figure: Any, axes: Any, centres_mm: FloatArray, diameter_mm: float, load: Any) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    circles = [Circle((x, y), diameter_mm / 2) for x, y in centres_mm]
    rollers = PatchCollection(circles, edgecolor=INK, linewidth=0.7, facecolor="#ffffff", zorder=4)
    axes.add_collection(rollers)
    if load is not None:
        rollers.set_array(load / 1e3)
        rollers.set_cmap("YlOrBr")
        rollers.set_clim(0, max(float(load.max()) / 1e3, 1e-9))
        bar = figure.colorbar(rollers, ax=axes, pad=0.02, aspect=24, shrink=0.85)
        bar.set_label("Contact force, kN", fontsize=7.5)
        bar.ax.tick_params(labelsize=7.5)


def _draw_load(axes: Any, angle: float, outer_mm: float, inner_mm: float, text: str) -> None:
    """An arrow that pushes the outer ring along `angle`, and the load zone it makes on the side it comes from."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    arrow = {"arrowstyle": "-|>", "color": BLUE, "lw": 2.6, "mutation_scale": 16}
    axes.annotate("", xy=-1.02 * direction * outer_mm, xytext=-1.34 * direction * outer_mm, arrowprops=arrow, zorder=6)
    x, y = -1.2 * direction * outer_mm - 0.06 * outer_mm * np.array([abs(direction[1]), abs(direction[0])])
    side = {"ha": "right", "va": "center"} if abs(direction[1]) > abs(direction[0]) else {"ha": "center", "va": "top"}
    axes.text(x, y, text or "load", color=BLUE, fontweight="bold", parse_math=False, **side)
    zone = -0.62 * direction * inner_mm
    axes.text(*zone, "load zone", ha="center", va="center", color=BLUE, fontsize=8)


def _draw_defect(axes: Any, defect: str, radius_mm: float, angle: float) -> None:
    at = radius_mm * np.array([np.cos(angle), np.sin(angle)])
    axes.plot(*at, marker="*", ms=13, mfc=VERMILION, mec="white", mew=0.8, ls="none", zorder=8)
    label = {"outer": "outer-race defect", "inner": "inner-race defect"}[defect]
    right, top = bool(at[0] > 0), bool(at[1] > 0)
    axes.annotate(
        label, at, xytext=(0.98 if right else 0.02, 0.98 if top else 0.02), textcoords="axes fraction",
        ha="right" if right else "left", va="top" if top else "bottom", color=VERMILION, fontsize=8, zorder=9,
        arrowprops={"arrowstyle": "-", "color": VERMILION, "lw": 0.8, "shrinkB": 5},
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1},
    )  # fmt: skip


def _draw_sensor(axes: Any, angle: float, outer_mm: float) -> None:
    at = 1.05 * outer_mm * np.array([np.cos(angle), np.sin(angle)])
    axes.plot(*at, marker="s", ms=8, mfc=INK, mec="white", zorder=8)
    axes.annotate("sensor", at, xytext=(7, 5), textcoords="offset points", fontsize=8, zorder=9)
