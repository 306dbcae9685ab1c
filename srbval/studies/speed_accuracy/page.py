"""Speed against accuracy: cost and error of every solver beside the paper's cost, as last stored."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from srbval.report.blocks import Badge, Block
from srbval.report.figures.style import INK, SERIES, VERMILION, Drawn, new_figure, panel
from srbval.report.pages import study_page
from srbval.report.prose import Prose

SIZE_INCHES = (7.6, 3.2)
SHOWN = ("interference-outer", "rig-outer")  # scenes of the chart
COST, ERROR = "cpu_per_simulated_s", "cage_error"


@panel
def chart(runs: pd.DataFrame, paper_s: float) -> Drawn:
    """Error in cage speed over cost for two scenes; runs that do not work are faint, the default has a ring."""
    figure, scenes = new_figure(SIZE_INCHES), [scene for scene in SHOWN if scene in set(runs["scene"])]
    for axes, scene in zip(figure.subplots(1, len(scenes), squeeze=False)[0], scenes, strict=True):
        own = runs[(runs["scene"] == scene) & (runs[ERROR] > 0)]
        for (solver, line), (mark, colour) in zip(own.groupby("solver", sort=False), SERIES, strict=False):
            works = line["ok"].astype(bool)
            axes.plot(line[COST], line[ERROR], f"{mark}-", color=colour, ms=5, mfc="none", lw=0.5, label=solver)
            axes.plot(line[COST][works], line[ERROR][works], mark, color=colour, ms=5)
        default = own[own["mark"] == "the default"]
        axes.plot(default[COST], default[ERROR], "o", mfc="none", mec=INK, ms=11)
        axes.axvline(paper_s, color=VERMILION, lw=1)
        axes.annotate("paper", (paper_s, 0.5), xycoords=("data", "axes fraction"), rotation=90, ha="right", fontsize=7)
        axes.set(xscale="log", yscale="log", xlabel="CPU s per simulated s", ylabel="Error in cage speed")
        axes.set_title(scene, fontsize=8.5)
    figure.axes[0].legend(frameon=False, fontsize=7)
    return figure, {
        key: runs[key].to_list() for key in ("scene", "solver", "dt_s", COST, ERROR, "noise_floor", "status")
    }


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """The chart, and the rows on its fronts, the default's and the paper's."""
    numbers = (COST, ERROR, "band_rms_error_db", "noise_floor")
    runs, paper = pd.DataFrame(content["runs"]).astype(dict.fromkeys(numbers, float)), content["paper"]
    paper_s = paper["wall_s"] / paper["simulated_s"]
    own = [row["own_cage_error"] for row in content["reference"].values() if row["own_cage_error"] is not None]
    values = {"runs": len(runs), "works": int(runs["ok"].sum()), "own": max(own), "paper_s": paper_s, **paper}
    yield prose.paragraph("intro", **values | {"steps_per_s": 1 / paper["step_s"]})
    yield prose.figure("speed-accuracy-chart", chart(runs, paper_s), badge=Badge.SIMULATED)
    noted = runs.assign(
        steps_per_s=1 / runs["dt_s"],
        solver_note=runs["mark"],
        status_tone=["good" if ok else "bad" for ok in runs["ok"]],
        cage_error_note=["within the converged run's own error" if own else "" for own in runs["reference_limited"]],
    )
    shown = noted[runs["pareto"].astype(bool) | (runs["mark"] != "")]
    yield prose.table("speed-accuracy-table", shown)


PAGE = study_page(__package__, 46, blocks, data=lambda content: {"speed_accuracy": content["runs"]})
