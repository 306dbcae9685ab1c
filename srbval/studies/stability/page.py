"""The largest step that each solver can take, over speed and scene, and the paper's two claims, as last stored."""

from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any

import pandas as pd

from srbval.report.blocks import Badge, Block, Listing
from srbval.report.figures.style import SERIES, Drawn, new_figure, panel
from srbval.report.pages import study_page
from srbval.report.prose import Prose
from srbval.report.tables import Title
from srbval.studies.stability.study import steps_by_speed

SIZE_INCHES = (7.6, 3.2)
LIMITS = ("largest_stable_dt_s", "predicted_elastic_limit_dt_s", "predicted_limit_dt_s")


def chart(limits: pd.DataFrame) -> Drawn:
    """Largest stable step over speed by scene, a cross at the top if none is; dashed: predicted without friction.

    Rows may have a name of their own, `series`, in place of the solver's.
    """
    figure, names = new_figure(SIZE_INCHES), list(limits["scene"].unique())
    limits = limits.assign(series=limits.get("series", limits["solver"])).astype(dict.fromkeys(LIMITS, float))
    looks = dict(zip(limits["series"].unique(), cycle(SERIES), strict=False))
    for axes, name in zip(figure.subplots(1, len(names), sharey=True, squeeze=False)[0], names, strict=True):
        for series, line in limits[limits["scene"] == name].groupby("series", sort=False):
            mark, colour = looks[str(series)]
            axes.plot(
                line["rpm"],
                1 / line["largest_stable_dt_s"],
                f"{mark}-",
                color=colour,
                ms=5,
                mfc="none",
                lw=1,
                label=series,
            )
            axes.plot(line["rpm"], 1 / line["predicted_elastic_limit_dt_s"], "--", color=colour, lw=0.7)
            none = line["rpm"][line["largest_stable_dt_s"].isna()]
            axes.plot(none, 0.98 + 0 * none, "x", color=colour, ms=5, transform=axes.get_xaxis_transform())
        axes.set(xscale="log", yscale="log", xlabel="Shaft speed, rpm")
        axes.xaxis.set_minor_formatter("")
        axes.set_title(name, fontsize=8.5)
    figure.axes[0].set_ylabel("Steps per second")
    figure.axes[0].legend(frameon=False, fontsize=7)
    return figure, {key: limits[key].to_list() for key in ("scene", "series", "rpm", *LIMITS)}


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """What counts as stable, the claims, the limits in a figure and a table."""
    limits = pd.DataFrame(content["limits"]).astype(dict.fromkeys(LIMITS, float))
    cells, steps, by_speed = content["cells"], content["steps_per_s"], steps_by_speed(content["limits"])
    stable = sum(cell["stable"] for cell in cells)
    values = {"cells": len(cells), "stable": stable, "finest": max(steps), "coarsest": min(steps)}
    yield prose.paragraph("intro", **values, **content["tolerances"])
    yield Listing(items=tuple(claim["answer"] for claim in content["claims"]))
    yield prose.figure("stability-chart", panel(chart)(limits), badge=Badge.SIMULATED, **values)
    speeds: dict[str, Title] = {name: (name, "1/s", ".0f") for name in by_speed.columns[2:]}
    yield prose.table("stability-limits", by_speed, {"scene": "Scene", "solver": "Solver"} | speeds)


PAGE = study_page(
    __package__, 48, blocks, data=lambda content: {"stability": content["cells"], "limits": content["limits"]}
)
