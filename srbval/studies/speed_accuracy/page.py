"""Speed against accuracy, from the stored benches of the paper's scenes and of the rig's."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from srbval.models.run import USABLE
from srbval.report.blocks import Badge, Block, Figure, Section
from srbval.report.pages import Page, StoredResults
from srbval.report.plain import literal
from srbval.report.section_texts import Texts, missing, origin_of
from srbval.scene import SolverSettings, paper_scene
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.speed_accuracy.figure import speed_accuracy_plot

TEXTS = Texts.of_study(__package__)
Row = Mapping[str, Any]
NAMES = ("speed_accuracy", "rig_speed_accuracy")  # the results, of the paper's scenes and of the rig's
PANELS = {
    "cage_error": "Cage speed's error",
    "band_rms_error": "500-1500 Hz RMS error",
    "noise_floor": "Envelope noise floor",
}
PAPER_SOLVER = "ode4"
MAIN_SCENES = ("interference-outer", "play0-outer", "rig-outer")  # of the short table; the chart shows the first
MOST_ROWS = 10  # of that table
CONVERGED = 0.1  # relative error of a path at twice the converged run's step, below which it has an order


def section(results: StoredResults) -> Section:
    """One chart and the rows that matter most; in the appendix the other charts, all such rows, orders and targets.

    A remark where nothing is stored. The bench of the rig's scene is shown beside the paper's where there is one.
    """
    result, rig, default = results.get(NAMES[0]), results.get(NAMES[1]), paper_scene().solver
    if result is None:
        return TEXTS.section(missing(NAMES[0]))
    content = result.content
    rows = [_marked(row, default) for row in content["runs"]]
    known = [r["own_cage_error"] for r in content["reference"].values() if r["own_cage_error"] is not None]
    intro: Block = TEXTS.paragraph(
        "intro",
        runs=len(rows),
        failed=sum(row["status"] not in USABLE for row in rows),
        reference_error=max(known, default=math.nan),
    )
    charts, shown = [*_charts(content, rows)], _shown(rows)
    chart = next((chart for chart in charts if chart.id.endswith(MAIN_SCENES[0])), charts[0])
    blocks: list[Block] = [one for one in charts if one is not chart]
    if rig is not None:
        own_steps = rig.content.get("default_step_s", {})
        of_rig = [
            _marked(row, replace(default, step_s=own_steps.get(row["scene"], default.step_s)))
            for row in rig.content["runs"]
        ]
        blocks += [TEXTS.paragraph("rig", runs=of_rig), origin_of(rig), *_charts(rig.content, of_rig)]
        shown += _shown(of_rig)
    table = TEXTS.table("speed-accuracy-table", shown, further_notes=list(_reasons(shown)))
    targets = TEXTS.table("speed-accuracy-targets", content["targets"])
    paths = [path for one in (content, results.content(NAMES[1])) for path in one.get("trajectories", ())]
    few = TEXTS.table("speed-accuracy-few", _few(shown))
    return TEXTS.section(intro, chart, few, appendix=(origin_of(result), *blocks, table, *_orders(paths), targets))


def _orders(paths: Sequence[Row]) -> Iterator[Block]:
    """The order that each solver was observed to have, where the converged run vouches for one."""
    told = [path for path in paths if path["reference_error"] < CONVERGED]
    scenes = list(dict.fromkeys(path["scene"] for path in told))
    rows = [
        {
            "solver": solver,
            "scenes": {path["scene"]: path["observed_order"] for path in told if path["solver"] == solver},
        }
        for solver in dict.fromkeys(path["solver"] for path in told)
    ]
    if rows:
        without = list(dict.fromkeys(path["scene"] for path in paths if path not in told))
        window_s = told[0]["window_s"]
        yield TEXTS.table("observed-orders", rows, scenes=scenes, without=without, window_s=window_s)


def _marked(row: Row, default: SolverSettings) -> dict[str, Any]:
    """A stored row with its step as a divisor of a second and the marks that it is shown with."""
    is_default = row["solver"] == default.name and math.isclose(row["dt_s"], default.step_s, rel_tol=1e-6)
    is_paper = row["solver"] == PAPER_SOLVER and math.isclose(row["dt_s"], PAPER_STEP_S, rel_tol=1e-6)
    marks = {"default": is_default, "the paper's": is_paper, "on the front": row["pareto"]}
    return {**row, "steps_per_s": 1 / row["dt_s"], "marks": [mark for mark, holds in marks.items() if holds]}


def _shown(rows: Sequence[Row]) -> list[Row]:
    """The marked rows and those that failed."""
    return [row for row in rows if row["status"] not in USABLE or row["marks"]]


def _few(rows: Sequence[Row]) -> list[Row]:
    """The default and the paper's solver in the scenes of the short table, and the front of the first as room is."""
    named = [row for row in rows if row["scene"] in MAIN_SCENES and set(row["marks"]) & {"default", "the paper's"}]
    front = [row for row in rows if row["scene"] == MAIN_SCENES[0] and row["marks"] == ["on the front"]]
    kept = [*named, *front[: max(MOST_ROWS - len(named), 0)]]
    return sorted(kept, key=lambda row: (MAIN_SCENES.index(row["scene"]), row["wall_per_simulated_s"]))


def _charts(content: Mapping[str, Any], rows: Sequence[Row]) -> Iterator[Figure]:
    for scene in dict.fromkeys(row["scene"] for row in rows):
        if scene in content["reference"]:
            yield _chart(content, [row for row in rows if row["scene"] == scene], scene)


def _chart(content: Mapping[str, Any], rows: Sequence[Row], scene: str) -> Figure:
    reference, name = content["reference"][scene], f"speed-accuracy-{scene}"
    plot = partial(
        speed_accuracy_plot,
        runs=rows,
        panels=PANELS,
        fronts=("cage_error", "band_rms_error"),
        floors={
            "cage_error": reference["own_cage_error"],
            "band_rms_error": reference["own_band_rms_error"],
            "noise_floor": reference["noise_floor"],
        },
    )
    return TEXTS.figure(
        "speed-accuracy", plot, id=name, badge=Badge.SIMULATED, scene=scene, runs=len(rows), rows=_shown(rows)
    )


def _reasons(rows: Sequence[Row]) -> Iterator[str]:
    """Each kind of failure once, in the words of its first run."""
    first: dict[str, str] = {}
    for row in rows:
        if row["status"] not in USABLE:
            first.setdefault(row["status"], row["reason"])
    yield from (f"**{status}**, for instance: {literal(reason)}." for status, reason in first.items())


PAGE = Page(
    name="speed_accuracy", place=46, results=NAMES, section=section,
    data=lambda results: {"speed_accuracy": [run for name in NAMES for run in results.content(name).get("runs", [])]},
)  # fmt: skip
