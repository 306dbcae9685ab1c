"""Power in oil beside two formulas, the trend of the cage ratio by effect, and where skidding sets in."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from srbval.report.blocks import Badge, Block
from srbval.report.figures.style import BLUE, GREEN, VERMILION, PanelFiles, figure_style, new_figure, save_panel
from srbval.report.pages import appendix_page
from srbval.report.section_texts import Texts

Row = Mapping[str, Any]
SIZE_INCHES = (7.6, 2.9)
LINES = {"drive_w": ("model", "-o", BLUE), "skf_w": ("SKF", "--s", VERMILION), "palmgren_w": ("Palmgren", ":^", GREEN)}
AXES = {"rpm": "Shaft speed, rpm", "radial_kn": "Radial load, kN"}


def blocks(texts: Texts, content: Row) -> Iterator[Block]:
    """Power in a figure, the trend of effects, ranges and draws in tables, onset of skidding in a table."""
    rows, trend, onset = (content[key] for key in ("rows", "trend", "onset"))
    of = {kind: [row for row in trend if row["kind"] == kind] for kind in ("effect", "range", "draw", "step", "free")}
    yield texts.figure("oil-power", partial(power_plot, rows=rows), badge=Badge.SIMULATED, rows=rows)
    yield texts.table("oil-power-table", rows)
    yield texts.paragraph("trend", **of)
    yield texts.table("oil-trend", of["effect"])
    if of["free"]:
        yield texts.table("oil-free", of["free"])
    yield texts.table("oil-ranges", of["range"])
    yield texts.paragraph("onset", rows=onset)
    yield texts.table("oil-onset", onset)


def power_plot(folder: Path, name: str, *, rows: Sequence[Row]) -> PanelFiles:
    """Draw power over speed at one load and over load at one speed; write picture and CSV."""
    with figure_style():
        figure = new_figure(SIZE_INCHES)
        for axes, (key, label) in zip(figure.subplots(1, 2), AXES.items(), strict=True):
            other = next(one for one in AXES if one != key)
            fixed = max((row[other] for row in rows), key=[row[other] for row in rows].count)
            own = sorted((row for row in rows if row[other] == fixed), key=lambda row: float(row[key]))
            for line, (title, mark, colour) in LINES.items():
                axes.plot([row[key] for row in own], [row[line] for row in own], mark, color=colour, label=title, ms=4)
            axes.set(xlabel=label, ylabel="Power, W", ylim=(0, None))
            axes.set_title(f"at {fixed:.4g} {AXES[other].rpartition(' ')[2]}", fontsize=8.5)
            axes.legend(frameon=False)
        return save_panel(figure, folder, name, {key: [row[key] for row in rows] for key in (*AXES, *LINES)})


PAGE = appendix_page(__package__, 44.3, blocks, data=lambda content: {"oil_effects": content.get("rows", [])})
