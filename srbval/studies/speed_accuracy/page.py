"""Speed against accuracy, from the stored benches of the paper's scenes and of the rig's."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.models.run import USABLE
from srbval.report.blocks import Badge, Block, Figure, Section
from srbval.report.pages import Page, StoredResults, missing, origin_of
from srbval.report.plain import literal
from srbval.report.section_texts import Texts
from srbval.scene import paper_scene
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
FLOORS = {"cage_error": "own_cage_error", "band_rms_error": "own_band_rms_error", "noise_floor": "noise_floor"}
FRONTS = {"cage_error": "pareto", "band_rms_error": "pareto_band"}
PAPER_SOLVER = "ode4"
MAIN_SCENES = ("interference-outer", "play0-outer", "rig-outer")  # of the short table; the chart shows the first
MOST_ROWS = 10  # of that table


def section(results: StoredResults) -> Section:
    """One chart and the rows that matter most; in the appendix the other charts and all such rows.

    A remark where nothing is stored. The bench of the rig's scene is shown beside the paper's where there is one.
    """
    result, rig = results.get(NAMES[0]), results.get(NAMES[1])
    if result is None:
        return TEXTS.section(missing(NAMES[0]))
    content = result.content
    rows = _marked(content)
    known = [r["own_cage_error"] for r in content["reference"].values() if r["own_cage_error"] is not None]
    failed = sum(row["status"] not in USABLE for row in rows)
    intro = TEXTS.paragraph("intro", runs=len(rows), failed=failed, reference_error=max(known, default=math.nan))
    charts, shown = list(_charts(content, rows)), _shown(rows)
    chart = next((chart for chart in charts if chart.id.endswith(MAIN_SCENES[0])), charts[0])
    blocks: list[Block] = [one for one in charts if one is not chart]
    if rig is not None:
        of_rig = _marked(rig.content)
        blocks += [TEXTS.paragraph("rig", runs=of_rig), origin_of(rig), *_charts(rig.content, of_rig)]
        shown += _shown(of_rig)
    return TEXTS.section(
        intro,
        chart,
        TEXTS.table("speed-accuracy-few", _few(shown)),
        appendix=(
            origin_of(result),
            *blocks,
            TEXTS.table("speed-accuracy-table", shown, further_notes=list(_reasons(shown))),
        ),
    )


def _marked(content: Row) -> list[dict[str, Any]]:
    """The stored rows with their steps as divisors of a second and the marks that they are shown with."""
    default, own_steps, found = paper_scene().solver, content.get("default_step_s", {}), []
    for row in content["runs"]:
        step_s = own_steps.get(row["scene"], default.step_s)
        marks = {
            "default": row["solver"] == default.name and math.isclose(row["dt_s"], step_s, rel_tol=1e-6),
            "the paper's": row["solver"] == PAPER_SOLVER and math.isclose(row["dt_s"], PAPER_STEP_S, rel_tol=1e-6),
            "on the front": row["pareto"],
        }
        found.append({**row, "steps_per_s": 1 / row["dt_s"], "marks": [mark for mark, holds in marks.items() if holds]})
    return found


def _shown(rows: Sequence[Row]) -> list[Row]:
    """The marked rows and those that failed."""
    return [row for row in rows if row["status"] not in USABLE or row["marks"]]


def _few(rows: Sequence[Row]) -> list[Row]:
    """The default and the paper's solver in the scenes of the short table, and the front of the first as room is."""
    named = [row for row in rows if row["scene"] in MAIN_SCENES and set(row["marks"]) & {"default", "the paper's"}]
    front = [row for row in rows if row["scene"] == MAIN_SCENES[0] and row["marks"] == ["on the front"]]
    kept = [*named, *front[: max(MOST_ROWS - len(named), 0)]]
    return sorted(kept, key=lambda row: (MAIN_SCENES.index(row["scene"]), row["wall_per_simulated_s"]))


def _charts(content: Mapping[str, Any], every: Sequence[Row]) -> Iterator[Figure]:
    for scene, reference in content["reference"].items():
        if rows := [row for row in every if row["scene"] == scene]:
            plot = speed_accuracy_plot(
                rows, panels=PANELS, fronts=FRONTS, floors={panel: reference[key] for panel, key in FLOORS.items()}
            )
            yield TEXTS.figure(
                "speed-accuracy", plot, id=f"speed-accuracy-{scene}", badge=Badge.SIMULATED, scene=scene,
                runs=len(rows), rows=_shown(rows),
            )  # fmt: skip


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
