"""Which runs were made, how they ended, what they cost; and every value of the scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from srbval.evidence.gather import Evidence
from srbval.models.run_file import scene_dict
from srbval.report.blocks import KeyValues, Paragraph
from srbval.report.model import Section
from srbval.report.table import Column, Table, Value

PAPER_WALL_PER_S = 86_400 / 1.26  # section 2.3: 1.26 simulated seconds a day


def runs_section(evidence: Evidence) -> Section:
    """Table of runs."""
    rows: list[list[Value]] = []
    costs = []
    for case in evidence.cases:
        run = evidence.runs[case.id]
        costs.append(run.wall_per_simulated_s)
        rows.append(
            [case.id, case.purpose, 60 * run.scene.shaft_hz, run.seconds, run.scene.solver.name,
             run.scene.solver.step_s * 1e6, run.status.value, run.cage_ratio,
             100 * run.energy.imbalance(1 / run.scene.output_rate_hz), costs[-1]]
        )  # fmt: skip
    return Section(
        id="runs",
        title="Runs",
        blocks=(
            Table(
                id="runs-table",
                label="Runs",
                caption="All runs behind this report. Every run is tested: finite state, penetration within "
                "the contact search, cage driven, load carried.",
                columns=(
                    Column(title="Run"),
                    Column(title="For"),
                    Column(title="Shaft", unit="rpm", format=".2f"),
                    Column(title="Recorded", unit="s", format=".3g"),
                    Column(title="Solver"),
                    Column(title="Step", unit="µs", format=".2f"),
                    Column(title="Status"),
                    Column(title="Cage / shaft", format=".5f"),
                    Column(title="Energy open", unit="%", format="+.1f"),
                    Column(title="Wall time per simulated second", unit="s/s", format=".2f"),
                ),
                rows=rows,
                notes=(
                    "**Energy open**: work put in by drive and load, less what is stored and what is lost, as a share "
                    "of the "
                    "losses. It measures how far the fixed step resolves the friction: it vanishes as the step "
                    "shrinks.",
                ),
            ),
            Paragraph(
                f"The paper reports {PAPER_WALL_PER_S:,.0f} s of computing per simulated second; the slowest run here "
                "took "
                f"{max(costs):.1f}, on one core of the machine named below, with other runs beside it."
            ),
        ),
    )


def scene_section(evidence: Evidence) -> Section:
    """Every value of the paper's outer-race scene, SI units in the names."""
    scene = evidence.runs["paper-outer"].scene
    return Section(
        id="scene",
        title="The scene, every value",
        blocks=(
            Paragraph(
                "As run for the outer-race row of Table 6, in SI units; the other runs differ only in what the tables "
                "above "
                "name. Printed values are those of the paper's Tables 1, 4 and 5."
            ),
            KeyValues(pairs=flatten(scene_dict(scene)) | flatten({"geometry": vars(evidence.bearing.geometry)})),
        ),
    )


def flatten(table: Mapping[str, Any], prefix: str = "") -> dict[str, Value]:
    """A nested table with dotted keys."""
    flat: dict[str, Value] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = float(f"{value:.12g}") if isinstance(value, float) else value
    return flat
