"""Speed against accuracy: cost and error of every solver beside the paper's cost, as last stored."""

from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any

import pandas as pd

from srbval.report.blocks import Badge, Block
from srbval.report.figures.style import INK, SERIES, VERMILION, Drawn, new_figure, panel
from srbval.report.pages import study_page
from srbval.report.prose import Prose
from srbval.sweep.scenes import PAPER

SIZE_INCHES = (7.6, 5.2)
SHOWN = ("interference-outer", "rig-outer")  # scenes of the chart
COST = "cpu_per_simulated_s"
ERRORS = {"level_db": "Error of the level, dB", "line_pct": "Error of BPFO, %"}
LEAST = 1e-6  # smaller errors are drawn there


def chart(runs: pd.DataFrame, paper_s: float = PAPER.wall_s / PAPER.simulated_s) -> Drawn:
    """Errors over cost by scene: hollow if not ok, a cross at the dear end for a run without them, a ring the default.

    Rows may have a name of their own, `series`, in place of the solver's.
    """
    runs = runs.assign(series=runs.get("series", runs["solver"]), line_pct=100 * runs["cage_error"].astype(float))
    runs = runs.assign(level_db=runs["band_rms_error_db"].astype(float).abs()).astype({COST: float})
    scenes = [scene for scene in SHOWN if scene in set(runs["scene"])] or list(runs["scene"].unique())
    figure = new_figure(SIZE_INCHES)
    looks = dict(zip(runs["series"].unique(), cycle(SERIES), strict=False))
    for column, scene in zip(figure.subplots(2, len(scenes), squeeze=False, sharex="col").T, scenes, strict=True):
        for axes, (error, label) in zip(column, ERRORS.items(), strict=True):
            _draw_errors(axes, runs[runs["scene"] == scene], error, looks)
            axes.axvline(paper_s, color=VERMILION, lw=1)
            axes.annotate(
                "paper", (paper_s, 0.5), xycoords=("data", "axes fraction"), rotation=90, ha="right", fontsize=7
            )
            axes.set(xscale="log", yscale="log", ylabel=label)
        column[0].set_title(scene, fontsize=8.5)
        column[1].set_xlabel("CPU s per simulated s")
    figure.axes[0].legend(frameon=False, fontsize=7)
    keys = ("scene", "series", "dt_s", COST, *ERRORS, "noise_floor", "status")
    return figure, {key: runs[key].to_list() for key in keys if key in runs}


def _draw_errors(axes: Any, runs: pd.DataFrame, error: str, looks: Mapping[str, tuple[str, str]]) -> None:
    """One error of a scene's runs over their cost; those without numbers are named at the right."""
    known = runs[COST].notna() & (runs["level_db"].notna())
    for series, line in runs[known].groupby("series", sort=False):
        (mark, colour), height = looks[str(series)], line[error].clip(lower=LEAST)
        axes.plot(line[COST], height, f"{mark}-", color=colour, ms=5, mfc="none", lw=0.5, label=series)
        axes.plot(line[COST].where(line["ok"].astype(bool)), height, mark, color=colour, ms=5)
    default = runs[known & (runs.get("mark") == "the default")] if "mark" in runs else runs[:0]
    axes.plot(default[COST], default[error].clip(lower=LEAST), "o", mfc="none", mec=INK, ms=11)
    for place, row in enumerate(runs[~known].drop_duplicates(["series", "status"]).to_dict("records")):
        at = (0.985, 0.95 - 0.09 * place)
        axes.plot(*at, "x", color=looks[row["series"]][1], transform=axes.transAxes)
        text = f"{row['series']}: {row['status']}"
        axes.annotate(text, at, (-5, 0), "axes fraction", "offset points", ha="right", va="center", fontsize=6.5)


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """The chart, and the rows on its fronts, the default's and the paper's."""
    numbers = (COST, "cage_error", "band_rms_error_db", "noise_floor")
    runs, paper = pd.DataFrame(content["runs"]).astype(dict.fromkeys(numbers, float)), content["paper"]
    paper_s = paper["wall_s"] / paper["simulated_s"]
    own = [row["own_cage_error"] for row in content["reference"].values() if row["own_cage_error"] is not None]
    values = {"runs": len(runs), "works": int(runs["ok"].sum()), "own": max(own), "paper_s": paper_s, **paper}
    yield prose.paragraph("intro", **values | {"steps_per_s": 1 / paper["step_s"]})
    yield prose.figure("speed-accuracy-chart", panel(chart)(runs, paper_s), badge=Badge.SIMULATED)
    noted = runs.assign(
        steps_per_s=1 / runs["dt_s"],
        line_error_pct=100 * runs["cage_error"],
        solver_note=runs["mark"],
        status_tone=["good" if ok else "bad" for ok in runs["ok"]],
        line_error_pct_note=[
            "within the converged run's own error" if own else "" for own in runs["reference_limited"]
        ],
    )
    shown = noted[runs["pareto"].astype(bool) | (runs["mark"] != "")]
    yield prose.table("speed-accuracy-table", shown)


PAGE = study_page(__package__, 46, blocks, data=lambda content: {"speed_accuracy": content["runs"]})
