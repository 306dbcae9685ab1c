"""The stability map: a block a solver, steps down, speeds across, a colour and a sign for each run's end."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.report.figures.style import INK, SOFT, Drawn, new_figure, panel

# status: (sign, face colour, ink, what it means). Light: may be read; dark: the bearing has come apart.
LOOKS = {
    "ok": ("", "#cfe8d8", "#00573f", "cage, band levels and power within tolerance"),
    "skidding": ("~", "#cfe8d8", "#00573f", "the same: rollers slide"),
    "rollers-unloaded": ("·", "#cfe8d8", "#00573f", "the same: rollers unloaded"),
    "inaccurate": ("±", "#eef3c4", "#4a5200", "stable, but beyond a tolerance"),
    "energy-open": ("≈", "#fbe7a1", "#6b5200", "energy does not close (found by the run)"),
    "step-too-long": ("↔", "#f7d08a", "#5a3b00", "step beyond what the contacts allow (found by the run)"),
    "unlike-reference": ("≠", "#f3b562", "#4a2c00", "not like the converged run (comparison only)"),
    "load-lost": ("↓", "#b8417a", "white", "load lost"),
    "cage-lost": ("○", "#8e3b76", "white", "cage not driven, and other evidence"),
    "too-deep": ("▼", "#a3161f", "white", "thrown too deep"),
    "not-finite": ("∞", "#39424d", "white", "not finite"),
    "refused": ("–", "#9aa5b1", "white", "not begun"),
    "no-reference": ("?", "#dfe4ea", INK, "converged run failed"),
}
UNKNOWN = ("!", "#39424d", "white", "other failure")
WIDE_BLOCKS = 2  # abreast, with room for the speeds in full size
ROW_INCHES, GAP_INCHES, HEAD_INCHES, WIDTH_INCHES = 0.165, 0.34, 0.75, 7.6
TALLEST_INCHES = 9.9  # fits a page of the PDF with its caption
COLUMNS = ("dt_s", "rpm", "status", "predicted_elastic_limit_dt_s", "predicted_limit_dt_s")  # of the CSV
Block = tuple[str, Sequence[Sequence[Mapping[str, Any]]]]


@panel
def stability_map(blocks: Sequence[Sequence[Block]]) -> Drawn:
    """`blocks`, rows of them (the last one may be shorter).

    A block is a title and its cells as they are stored, [steps (short to long), speeds], all with the same axes. The
    predicted limits of its speeds are drawn as lines: solid elastic, dashed whole.
    """
    first = blocks[0][0][1]
    steps_per_s, rpm = [round(1 / line[0]["dt_s"]) for line in first], [cell["rpm"] for cell in first[0]]
    height = min(TALLEST_INCHES, HEAD_INCHES + len(blocks) * (GAP_INCHES + len(steps_per_s) * ROW_INCHES))
    figure = new_figure((WIDTH_INCHES, height))
    axes = figure.subplots(len(blocks), len(blocks[0]), squeeze=False)
    for line, row in zip(axes, blocks, strict=True):
        for ax, block in zip(line, row, strict=False):
            _draw(ax, block, steps_per_s)
        for ax in line[len(row) :]:
            ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_yticks(_middles(steps_per_s), labels=[f"1/{n}" for n in steps_per_s], fontsize=6.5)
    for ax in axes[-1]:
        size = 7 if len(blocks[0]) <= WIDE_BLOCKS else 5
        ax.set_xticks(_middles(rpm), labels=[f"{r:g}" for r in rpm], fontsize=size)
        ax.set_xlabel("Shaft speed, rpm")
    figure.supylabel("Step, s", fontsize=8.5)
    cells = [(title, cell) for row in blocks for title, lines in row for line in lines for cell in line]
    _legend(figure, Counter(cell["status"] for _, cell in cells))
    columns: dict[str, list[Any]] = {
        key: [math.nan if cell[key] is None else cell[key] for _, cell in cells] for key in COLUMNS
    }
    return figure, {"block": [title for title, _ in cells], **columns}


def _middles(values: Sequence[float]) -> list[float]:
    return [i + 0.5 for i in range(len(values))]


def _draw(ax: Any, block: Block, steps_per_s: Sequence[int]) -> None:
    title, lines = block
    places: dict[str, list[tuple[int, int]]] = {}
    for i, line in enumerate(lines):
        for j, cell in enumerate(line):
            places.setdefault(cell["status"], []).append((j, i))
    for status, own in places.items():
        _fill(ax, own, *LOOKS.get(status, UNKNOWN)[:3])
    for limit, style, width in zip(COLUMNS[-2:], ("-", (0, (2, 1.5))), (1.6, 1.3), strict=True):
        for j, cell in enumerate(lines[0]):
            height = _place(cell[limit], steps_per_s)
            ax.plot([j, j + 1], [height, height], color=INK, ls=style, lw=width, clip_on=False, solid_capstyle="butt")
    ax.set(xlim=(0, len(lines[0])), ylim=(len(steps_per_s), 0), xticks=[], yticks=[])
    ax.set_title(title, fontsize=7.5, pad=3, color=INK)
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _fill(ax: Any, places: Sequence[tuple[int, int]], sign: str, face: str, ink: str) -> None:
    """All cells of one status as one path, and its sign in each: a picture of thousands of parts would be large."""
    from matplotlib.markers import MarkerStyle
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline
    from matplotlib.textpath import TextPath
    from matplotlib.transforms import Affine2D

    cells = [Affine2D().translate(j, i).transform_path(Outline.unit_rectangle()) for j, i in places]
    ax.add_patch(PathPatch(Outline.make_compound_path(*cells), facecolor=face, edgecolor="white", lw=0.6))
    if sign:
        drawn = TextPath((0, 0), sign, size=7)
        box = drawn.get_extents()
        outline = Affine2D().translate(-(box.x0 + box.x1) / 2, -(box.y0 + box.y1) / 2).transform_path(drawn)
        x, y = zip(*((j + 0.5, i + 0.5) for j, i in places), strict=True)
        size = 2 * float(np.abs(np.asarray(outline.vertices)).max())  # a marker is scaled to its largest coordinate
        ax.plot(x, y, ls="", marker=MarkerStyle(outline), ms=size, mew=0, color=ink)


def _place(limit_s: float | None, steps_per_s: Sequence[int]) -> float:
    """Height of a limit among the rows, logarithmic between them; at the edge where it lies outside the map."""
    rows = len(steps_per_s)
    if limit_s is None or limit_s * steps_per_s[-1] >= math.sqrt(2):
        return float(rows)
    if limit_s * steps_per_s[0] <= 1 / math.sqrt(2):
        return 0.0
    steps = [-math.log2(n) for n in steps_per_s]
    known = ([steps[0] - 0.5, *steps, steps[-1] + 0.5], [0.0, *(i + 0.5 for i in range(rows)), float(rows)])
    return float(np.interp(math.log2(limit_s), *known))


def _legend(figure: Any, counts: Mapping[str, int]) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for status in [*(s for s in LOOKS if s in counts), *(s for s in counts if s not in LOOKS)]:
        sign, face, _, meaning = LOOKS.get(status, UNKNOWN)
        label = f"{sign}  {status}: {meaning} ({counts[status]})".strip()
        handles.append(Line2D([], [], marker="s", ls="", ms=8, mfc=face, mec=SOFT, mew=0.4, label=label))
    handles += [
        Line2D([], [], color=INK, lw=1.6, label="predicted limit, friction left out"),
        Line2D([], [], color=INK, lw=1.3, ls=(0, (2, 1.5)), label="predicted limit (at the edge: beyond the map)"),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=2, fontsize=7, frameon=False, handletextpad=0.6)
