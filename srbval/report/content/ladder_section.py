"""The ladder of models: error against cost for each question, and what sets the missing harmonic of Figure 12."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from srbval.bench.ladder.table import LadderCalibration, summary
from srbval.models.ladder import RUNGS
from srbval.plan.calibrated import shipped_calibration
from srbval.report.badges import Badge
from srbval.report.blocks import Figure, Listing, Paragraph
from srbval.report.content.harmonic_blocks import harmonic_blocks
from srbval.report.content.held_out_blocks import held_out_blocks
from srbval.report.figures.ladder import ladder_plot
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table


def ladder_data() -> list[dict[str, Any]]:
    """The rows of ``report.json``'s `ladder`, from the calibration table that comes with the program."""
    return summary(shipped_calibration())


def ladder_section(folder: Path) -> Section:
    """Figure, table, rungs, harmonic pattern; numbers from the calibration table that comes with the program."""
    table = shipped_calibration()
    rows = summary(table)
    return Section(
        id="ladder",
        title="Model no more than a scene needs",
        blocks=(
            Paragraph(
                f"The same {len(table.entries)} scenes ({table.seconds:g} s each) on every rung of a ladder of models, "
                f"read through the one pipeline and held against the {table.reference}. The table was measured by "
                f"`srbval bench --ladder` on {_machine(table)} and comes with the program; `srbval plan` uses it."
            ),
            Listing(items=tuple(f"**{rung.name}**: {rung.title}." for rung in RUNGS if rung.name in table.models)),
            _figure(rows, folder),
            _table(rows),
            *held_out_blocks(),
            *harmonic_blocks(),
        ),
    )


def _machine(table: LadderCalibration) -> str:
    return str(table.machine.get("processor", "a machine that did not say"))


def _figure(rows: list[dict[str, Any]], folder: Path) -> Figure:
    files = ladder_plot(folder, "ladder", rows=rows)
    return Figure(
        id="ladder-figure", label="The ladder", file=files.picture, data=files.data, badge=Badge.SIMULATED,
        caption="Error against cost, one mark a rung: the median over the calibration scenes, the bar up to the worst. "
        "Hollow marks above an axis gave no answer on any scene. Dashed: 0.5 %. Slip errs by 100 % where a cage rolls "
        "without any.",
        alt="Six panels, one a question, with the error in per cent over the wall time per simulated second for each "
        "rung of the ladder; cheap rungs err little on line frequencies and much on everything else.",
    )  # fmt: skip


def _table(rows: list[dict[str, Any]]) -> Table:
    models = list(dict.fromkeys(row["model"] for row in rows))
    return Table(
        id="ladder-table",
        label="Ladder",
        caption="What each rung's answers are off by, in per cent of what the question names.",
        columns=(Column(title="Question"), *(Column(title=_headed(rows, m), unit="%", format=".3g") for m in models)),
        rows=[[title, *(_cell(rows, title, m) for m in models)] for title in dict.fromkeys(r["title"] for r in rows)],
        notes=(
            "Median over the scenes; below it the worst one, and the scenes without an answer. In the heading the cost "
            "in wall time per simulated second.",
            *dict.fromkeys(f"**{row['title'].capitalize()}**: per cent of {row['error_of']}." for row in rows),
        ),
    )


def _headed(rows: list[dict[str, Any]], model: str) -> str:
    cost = next(row["wall_per_simulated_s"] for row in rows if row["model"] == model)
    return f"{model}, {cost:.2g} s/s"


def _cell(rows: list[dict[str, Any]], title: str, model: str) -> Cell:
    """Median error with the worst, and what stayed without an answer, below it."""
    row = next(r for r in rows if (r["title"], r["model"]) == (title, model))
    worst = row["worst_error_pct"]
    said = ["" if worst is None else f"worst {worst:.3g}", f"{row['unanswered']} none" if row["unanswered"] else ""]
    return Cell(value=row["median_error_pct"], note=", ".join(filter(None, said)))
