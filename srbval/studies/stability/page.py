"""Report page: largest stable step of each solver over speed and scene, and tests of two claims of the paper."""

from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any

import pandas as pd

from srbval.report.blocks import Block, Callout, Listing, Tone
from srbval.report.figures.style import SERIES, Panel, PanelData, new_figure
from srbval.report.pages import Page
from srbval.report.prose import Prose

SIZE_INCHES = (7.6, 3.0)
LIMITS = ("largest_stable_dt_s", "predicted_elastic_limit_dt_s", "predicted_limit_dt_s")
SCENES = {
    "play0-outer": "paper's scene, rollers touching",
    "interference-outer": "paper's scene, rollers as printed",
    "rig-outer": "rig's scene",
}
RPM, DEFAULT, PAPERS = 710.0, "imex2", "ode4"  # in the tile: speed of the paper, default solver, solver of the paper


def chart(limits: pd.DataFrame) -> PanelData:
    """Plot the fewest steps per simulated second of a stable run by shaft speed; the caption explains the marks."""
    figure, names = new_figure(SIZE_INCHES), list(limits["scene"].unique())
    limits = limits.assign(certain=limits.get("certain", True)).astype(dict.fromkeys(LIMITS, float))
    looks = dict(zip(limits["series"].unique(), cycle(SERIES), strict=False))
    for axes, name in zip(figure.subplots(1, len(names), sharey=True, squeeze=False)[0], names, strict=True):
        for series, line in limits[limits["scene"] == name].groupby("series", sort=False):
            mark, colour = looks[str(series)]
            look = {"color": colour, "ms": 5}
            axes.plot(line["rpm"], 1 / line["largest_stable_dt_s"], f"{mark}-", mfc="none", lw=1, label=series, **look)
            certain = line[line["certain"].astype(bool)]
            axes.plot(certain["rpm"], 1 / certain["largest_stable_dt_s"], mark, **look)
            axes.plot(line["rpm"], 1 / line["predicted_elastic_limit_dt_s"], "--", color=colour, lw=0.7)
            none = line["rpm"][line["largest_stable_dt_s"].isna()]
            axes.plot(none, 0.98 + 0 * none, "x", transform=axes.get_xaxis_transform(), **look)
        axes.set(xscale="log", yscale="log", xlabel="Shaft speed, rpm")
        axes.set_xticks([200, 1000, 5000], labels=["200", "1000", "5000"])
        axes.minorticks_off()
        axes.set_title(SCENES.get(name, name), fontsize=7.5)
    figure.axes[0].set_ylabel("Least steps per second")
    named = figure.axes[0].get_legend_handles_labels()
    figure.legend(*named, loc="outside lower center", ncols=7, frameon=False, fontsize=7)
    return figure, {key: limits[key].to_list() for key in ("scene", "series", "rpm", "certain", *LIMITS)}


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """Build the blocks of the page: criterion of stability, chart of the largest stable steps, the paper's claims."""
    limits, cells = pd.DataFrame(content["limits"]).astype(dict.fromkeys(LIMITS, float)), content["cells"]
    stable, finest = sum(cell["stable"] for cell in cells), max(content["steps_per_s"])
    yield prose.paragraph("intro", cells=len(cells), stable=stable, **content["tolerances"])
    yield prose.figure("stability-chart", Panel(chart, limits), badge="simulated", finest=finest)
    yield Listing(items=tuple(claim["answer"] for claim in content["claims"]))


def tile(prose: Prose, content: Mapping[str, Any]) -> Callout:
    """Summary for the report: largest stable steps of the default and the paper's solver at the paper's speed."""
    words: dict[str, Any] = {"default": DEFAULT, "ode4": PAPERS}
    at_rpm = [one for one in content["limits"] if one["rpm"] == RPM]
    largest_s = {(one["scene"], one["solver"]): one["largest_stable_dt_s"] or 0.0 for one in at_rpm}
    for name, solver in tuple(words.items()):
        *paper, rig = (largest_s.get((scene, solver), 0.0) for scene in SCENES)
        for scene, step_s in (("paper", min(paper)), ("rig", rig)):
            words[f"{name}_{scene}"] = f"1/{1 / step_s:.0f} s" if step_s else "none"
    return prose.callout("tile", tone=Tone.NEUTRAL, rpm=RPM, **words, finest=max(content["steps_per_s"]))


PAGE = Page(
    __package__, 60, blocks, lambda content, _: {"stability": content["cells"], "limits": content["limits"]}, tile
)
