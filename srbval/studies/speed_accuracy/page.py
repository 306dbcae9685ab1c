"""Report page on speed against accuracy: cost and error of every solver beside the paper's cost."""

from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any

import pandas as pd

from srbval.report.blocks import Block
from srbval.report.figures.style import INK, SERIES, VERMILION, Panel, PanelData, new_figure
from srbval.report.pages import Page
from srbval.report.prose import Prose
from srbval.studies.bench import pareto_front
from srbval.sweep.scenes import PAPER

SIZE_INCHES = (7.6, 4.2)
CHART_SCENES = {"interference-outer": "paper's scene", "rig-outer": "rig's scene"}
TICKS = (0.25, 0.5, 1, 2, 4)  # CPU seconds per simulated second
COST = "cpu_per_simulated_s"
ERRORS = {"level_db": "Error of the level, dB", "line_pct": "Error of BPFO, %"}
PAPER_S = PAPER.wall_s / PAPER.simulated_s
MIN_DRAWN_ERROR = 1e-6  # smaller errors are drawn at this value


def chart(runs: pd.DataFrame) -> PanelData:
    """Draw errors over CPU time by scene and solver, with the paper's time per simulated second in the title.

    Filled markers are runs that `simulate` accepts, hollow ones are not; a ring marks the default solver and step.
    """
    runs = runs.assign(series=runs.get("series", runs["solver"]), line_pct=100 * runs["cage_error"].astype(float))
    runs = runs.assign(level_db=runs["band_rms_error_db"].astype(float).abs()).astype({COST: float})
    scenes = [scene for scene in CHART_SCENES if scene in set(runs["scene"])] or list(runs["scene"].unique())
    figure = new_figure(SIZE_INCHES)
    looks = dict(zip(runs["series"].unique(), cycle(SERIES), strict=False))
    for column, scene in zip(figure.subplots(2, len(scenes), squeeze=False, sharex="col").T, scenes, strict=True):
        for axes, (error, label) in zip(column, ERRORS.items(), strict=True):
            _draw_errors(axes, runs[runs["scene"] == scene], error, looks)
            axes.set(xscale="log", yscale="log", ylabel=label)
            axes.set_xticks(TICKS, labels=[f"{x:g}" for x in TICKS])
            axes.minorticks_off()
        column[0].set_title(CHART_SCENES.get(scene, scene), fontsize=8.5, loc="left")
        column[0].set_title(f"the paper: {PAPER_S:,.0f} s →", fontsize=8.5, loc="right", color=VERMILION)
        column[1].set_xlabel("Processor s per simulated s")
    named = figure.axes[0].get_legend_handles_labels()
    figure.legend(*named, loc="outside lower center", ncols=7, frameon=False, fontsize=7.5)
    keys = ("scene", "series", "dt_s", COST, *ERRORS, "noise_floor", "status")
    return figure, {key: runs[key].to_list() for key in keys if key in runs}


def _draw_errors(axes: Any, runs: pd.DataFrame, error: str, looks: Mapping[str, tuple[str, str]]) -> None:
    """Draw one error of a scene's runs over their CPU time, and their Pareto front; `looks`: marker, colour by series.

    Runs without values are named, with their status, at the right edge.
    """
    known = runs[COST].notna() & (runs["level_db"].notna())
    for series, line in runs[known].groupby("series", sort=False):
        (mark, colour), height = looks[str(series)], line[error].clip(lower=MIN_DRAWN_ERROR)
        axes.plot(line[COST], height, f"{mark}-", color=colour, ms=5, mfc="none", lw=0.5, label=series)
        axes.plot(line[COST].where(line["ok"].astype(bool)), height, mark, color=colour, ms=5)
    front = pareto_front(runs, error)
    axes.step(front[COST], front[error].clip(lower=MIN_DRAWN_ERROR), where="post", color=INK, lw=1.2)
    default = runs[known & (runs.get("mark") == "the default")] if "mark" in runs else runs[:0]
    axes.plot(default[COST], default[error].clip(lower=MIN_DRAWN_ERROR), "o", mfc="none", mec=INK, ms=11)
    for place, row in enumerate(runs[~known].drop_duplicates(["series", "status"]).to_dict("records")):
        at = (0.985, 0.95 - 0.09 * place)
        axes.plot(*at, "x", color=looks[row["series"]][1], transform=axes.transAxes)
        text = f"{row['series']}: {row['status']}"
        axes.annotate(text, at, (-5, 0), "axes fraction", "offset points", ha="right", va="center", fontsize=6.5)


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """Build the page: chart of all runs, and table of the default and of the paper's solver."""
    numbers = (COST, "cage_error", "band_rms_error_db")
    runs = pd.DataFrame(content["runs"]).astype(dict.fromkeys(numbers, float))
    own = [row["own_cage_error"] for row in content["reference"].values() if row["own_cage_error"] is not None]
    values = {"runs": len(runs), "works": int(runs["ok"].sum()), "own_pct": 100 * max(own), "paper_s": PAPER_S}
    yield prose.paragraph("intro", **values, **vars(PAPER), steps_per_s=1 / PAPER.step_s)
    yield prose.figure("speed-accuracy-chart", Panel(chart, runs), badge="simulated")
    shown = runs[runs["scene"].isin(CHART_SCENES) & (runs["mark"] != "")]
    shown = shown.assign(steps_per_s=1 / shown["dt_s"], solver_note=shown["mark"], line_pct=100 * shown["cage_error"])
    tones = ["good" if ok else "bad" for ok in shown["ok"]]
    shown = shown.assign(scene=shown["scene"].map(CHART_SCENES), status_tone=tones)
    yield prose.table("speed-accuracy-table", shown)


PAGE = Page(__package__, 50, blocks, lambda content, _: {"speed_accuracy": content["runs"]})
