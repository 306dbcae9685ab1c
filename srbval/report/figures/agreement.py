"""Predicted against measured, one panel: on the diagonal model and rig agree."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, INK, figure_style
from srbval.validation.bias import Pair


def agreement_plot(folder: Path, name: str, *, pairs: Sequence[Pair], label: str) -> PanelFiles:
    """Draw `pairs` of one unit, with the line of agreement and the data's 95 % intervals; write picture and CSV."""
    with figure_style():
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(3.6, 3.4), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        rig, model = [p.rig for p in pairs], [p.model for p in pairs]
        ends = [min(rig + model), max(rig + model)]
        axes.plot(ends, ends, color=INK, lw=0.9)
        half = [p.data_ci95 for p in pairs]
        axes.errorbar(rig, model, xerr=half, fmt="o", color=BLUE, ms=4, lw=0.8)
        axes.set(xlabel=f"Measured {label}", ylabel=f"Predicted {label}")
        columns = {"measured": rig, "predicted": model, "measured_ci95": half}
        return save_panel(figure, folder, name, columns)
