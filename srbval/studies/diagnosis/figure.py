"""How often the most probable class was right, over the probability that was said."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.report.figures.style import BLUE, INK, SOFT, PanelFiles, figure_style, new_axes, save_panel


def reliability_plot(folder: Path, name: str, *, rows: Sequence[Mapping[str, Any]]) -> PanelFiles:
    """Draw the rows of `bench.naming_scores.reliability` over the diagonal, with their bands; write picture and CSV.

    The band of a bin is what right probabilities give in 95 % of draws; the number is that of its records.
    """
    said, right, low, high = ([row[key] for row in rows] for key in ("said", "right", "low", "high"))
    with figure_style():
        figure, axes = new_axes((3.8, 3.6))
        axes.plot([0, 1], [0, 1], color=INK, lw=0.9)
        axes.vlines(said, low, high, color=SOFT, lw=6, alpha=0.35, label="95 % if the probabilities are right")
        axes.plot(said, right, "o", color=BLUE, ms=6, label="found")
        for row in rows:
            at = row["said"], row["right"]
            axes.annotate(f"{row['records']}", at, xytext=(-7, -3), textcoords="offset points", ha="right")
        axes.set(xlim=(0, 1.03), ylim=(0, 1.03), xlabel="Probability said", ylabel="Share that was right")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
        return save_panel(figure, folder, name, {key: [row[key] for row in rows] for key in rows[0]})
