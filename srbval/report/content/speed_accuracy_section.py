"""Speed against accuracy: what each method costs and how wrong it is, from the newest stored benchmark."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.bench.scenes import PAPER_STEP_S
from srbval.report.badges import Badge, Tone
from srbval.report.blocks import Block, Figure, Paragraph
from srbval.report.content.kept_result import missing, origin_of
from srbval.report.figures.speed_accuracy import CostPoint, speed_accuracy_plot
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table, Value
from srbval.scene import paper_scene
from srbval.storage.stored_result import SPEED_ACCURACY, StoredResult

Row = Mapping[str, Any]
PANELS = {
    "cage_error": "Cage speed's error",
    "band_rms_error": "500-1500 Hz RMS error",
    "noise_floor": "Envelope noise floor",
}
PAPER_SOLVER = "ode4"


def speed_accuracy_section(kept: StoredResult | None, folder: Path) -> Section:
    """Charts, the rows that matter, the targets; a remark where nothing is stored."""
    blocks: list[Block] = [missing(SPEED_ACCURACY)] if kept is None else _blocks(kept, folder)
    return Section(id="speed-accuracy", title="Speed against accuracy", blocks=tuple(blocks))


def _blocks(kept: StoredResult, folder: Path) -> list[Block]:
    content = kept.content
    rows = content["runs"]
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    return [
        _intro(content),
        origin_of(kept),
        *(_chart(content, scene, folder) for scene in scenes if scene in content["reference"]),
        _table(rows),
        _targets(content["targets"]),
    ]


def _intro(content: Mapping[str, Any]) -> Paragraph:
    rows = content["runs"]
    failed = sum(row["status"] != "ok" for row in rows)
    references = [r for r in content["reference"].values() if r["own_cage_error"] is not None]
    worst = max((r["own_cage_error"] for r in references), default=math.nan)
    return Paragraph(
        f"{len(rows)} runs of the full model against converged ones of the same scene, which at twice their step move "
        f"by at most {worst:.1g} in cage speed. Time is wall time on one core. **{failed} of them failed**; such runs "
        "stand in a row of their own, at what they cost, and are on no front. The ring marks the default solver at its "
        "default step; the dotted line is real time."
    )


def _chart(content: Mapping[str, Any], scene: str, folder: Path) -> Figure:
    rows = [row for row in content["runs"] if row["scene"] == scene]
    reference = content["reference"][scene]
    files = speed_accuracy_plot(
        folder,
        f"speed-accuracy-{scene}",
        points=[_point(row) for row in rows],
        panels=PANELS,
        fronts=("cage_error", "band_rms_error"),
        floors={
            "cage_error": reference["own_cage_error"],
            "band_rms_error": reference["own_band_rms_error"],
            "noise_floor": reference["noise_floor"],
        },
    )
    return Figure(
        id=f"speed-accuracy-{scene}",
        label=f"Speed against accuracy, {scene}",
        caption="Each solver at several steps: cost to the right, error upwards. Dashed: how far the converged run "
        "itself moves at twice its step, and its own noise floor; a floor is right there, not where it is low.",
        alt=_alt(scene, rows),
        file=files.picture,
        data=files.data,
        badge=Badge.SIMULATED,
    )


def _point(row: Row) -> CostPoint:
    return CostPoint(
        solver=row["solver"],
        dt_s=row["dt_s"],
        cost=row["wall_per_simulated_s"],
        values={name: row[name] for name in PANELS},
        status=row["status"],
        ringed=_is_default(row),
    )


def _is_default(row: Row) -> bool:
    solver = paper_scene().solver
    return row["solver"] == solver.name and math.isclose(row["dt_s"], solver.step_s, rel_tol=1e-6)


def _is_paper(row: Row) -> bool:
    return row["solver"] == PAPER_SOLVER and math.isclose(row["dt_s"], PAPER_STEP_S, rel_tol=1e-6)


def _alt(scene: str, rows: Sequence[Row]) -> str:
    said = []
    for row in rows:
        name = f"{row['solver']} at 1/{1 / row['dt_s']:.0f} s"
        if row["status"] != "ok":
            said.append(f"{name} failed ({row['status']})")
        elif row["pareto"] or _is_default(row) or _is_paper(row):
            error = row["cage_error"]
            said.append(
                f"{name} {row['wall_per_simulated_s']:.3g} s/s, cage error {error if error is None else f'{error:.1g}'}"
            )
    return (
        f"Scatter plots of error over cost for {scene}, {len(rows)} runs. Front, default and failed: {'; '.join(said)}."
    )


def _table(rows: Sequence[Row]) -> Table:
    shown = [row for row in rows if row["status"] != "ok" or row["pareto"] or _is_default(row) or _is_paper(row)]
    return Table(
        id="speed-accuracy-table",
        label="Speed against accuracy",
        caption="The front in cage speed, the default, the paper's ode4 at its step, and every failed run.",
        columns=(
            Column(title="Scene, solver"),
            Column(title="Steps", unit="1/s", format=".0f"),
            Column(title="Cost", unit="s/s", format=".3f"),
            Column(title="Cage error", format=".1e"),
            Column(title="Noise floor", format=".1e"),
            Column(title="500-1500 Hz RMS error", unit="%", format=".1f"),
            Column(title="Harmonics' error", format=".2f"),
            Column(title="Status"),
        ),
        rows=[_cells(row) for row in shown],
        notes=(
            *_reasons(shown),
            "Errors relative to the converged run; a cage error not above that run's own is "
            "marked **reference-limited** and may be chance. "
            "**All rows**: `speed_accuracy` in report.json and the charts' data files.",
        ),
    )


def _reasons(rows: Sequence[Row]) -> list[str]:
    """Each kind of failure once, in the words of its first run."""
    first: dict[str, str] = {}
    for row in rows:
        if row["status"] != "ok":
            first.setdefault(row["status"], row["reason"])
    return [f"**{status}**, for instance: {literal(reason)}." for status, reason in first.items()]


def _cells(row: Row) -> list[Cell | Value]:
    marks = [word for word, told in (("default", _is_default(row)), ("the paper's", _is_paper(row))) if told]
    marks += ["on the front"] if row["pareto"] else []
    ok = row["status"] == "ok"
    band = row["band_rms_error"]
    return [
        Cell(value=f"{row['scene']}, {row['solver']}", note=", ".join(marks)),
        1 / row["dt_s"],
        row["wall_per_simulated_s"],
        Cell(value=row["cage_error"], note="reference-limited" if row["reference_limited"] else ""),
        row["noise_floor"],
        None if band is None else 100 * band,
        row["harmonic_error"],
        Cell(value=row["status"], tone=Tone.GOOD if ok else Tone.BAD),
    ]


def _targets(targets: Sequence[Row]) -> Table:
    said = {True: ("met", Tone.GOOD), False: ("not met", Tone.BAD), None: ("not measured", Tone.NEUTRAL)}
    return Table(
        id="speed-accuracy-targets",
        label="Targets",
        caption="What the benchmark's figures are held against.",
        columns=(
            Column(title="Target"),
            Column(title="Measured", format=".3g"),
            Column(title="Limit", format=".3g"),
            Column(title="Unit"),
            Column(title="Verdict"),
        ),
        rows=[
            [t["name"], t["value"], t["limit"], t["unit"], Cell(value=said[t["met"]][0], tone=said[t["met"]][1])]
            for t in targets
        ],
    )
