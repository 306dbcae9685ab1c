"""Stability: where each method of time integration fails, and the paper's two claims held against that."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.report.badges import Badge, Tone
from srbval.report.blocks import Block, Callout, Figure, Listing, Paragraph
from srbval.report.content.kept_result import missing, origin_of
from srbval.report.figures.stability_map import MapBlock, stability_map
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table
from srbval.scene import paper_scene
from srbval.storage.stored_result import STABILITY, StoredResult

Row = Mapping[str, Any]


def stability_section(kept: StoredResult | None, folder: Path) -> Section:
    """Claims, map, table of limits and what the runs themselves did not see; a remark where nothing is stored."""
    blocks: list[Block] = [missing(STABILITY)] if kept is None else _blocks(kept, folder)
    return Section(id="stability", title="Stability: where each method fails", blocks=tuple(blocks))


def _blocks(kept: StoredResult, folder: Path) -> list[Block]:
    content = kept.content
    return [
        _intro(content),
        origin_of(kept),
        *(block for claim in content["claims"] for block in _claim(claim)),
        *(_map(content, scene, folder) for scene in content["grid"]["scenes"]),
        _limits(content["cells"]),
        _honesty(content),
    ]


def _intro(content: Mapping[str, Any]) -> Paragraph:
    grid, counts = content["grid"], content["counts"]
    error = max(max(r["own_cage_error"], r["own_load_error"]) for r in content["references"])
    return Paragraph(
        f"{counts['cells']} runs: {len(grid['solvers'])} methods, steps of 1/{max(grid['steps_per_s'])} to "
        f"1/{min(grid['steps_per_s'])} s, {min(grid['rpm']):g} to {max(grid['rpm']):g} rpm, two critical velocities of "
        f"friction. Each lasts {grid['seconds']:g} s or {grid['passages']:g} roller passages after settling and is "
        f"held against a converged run of the same scene (1/{grid['reference_steps_per_s']} s; at twice that step it "
        f"moves by at most {error:.1%}). **ok** means that the run found nothing wrong with itself, its cage is within "
        f"1 % and the load on its rollers 95 to 110 % of the converged run's. **{counts['ok']} are ok.**"
    )


def _claim(claim: Row) -> list[Block]:
    tone = {True: Tone.GOOD, False: Tone.BAD, None: Tone.NEUTRAL}[claim["borne_out"]]
    said = {True: "borne out", False: "not borne out", None: "not covered"}[claim["borne_out"]]
    return [
        Callout(
            tone=tone,
            title=f"The paper: “{literal(claim['claim'])}” Here: {said}.",
            text=literal(claim["answer"]),
        ),
        Listing(items=tuple(literal(line) for line in claim["evidence"])),
    ]


def _map(content: Mapping[str, Any], scene: str, folder: Path) -> Figure:
    grid = content["grid"]
    cells = {
        (c["solver"], c["critical_velocity_m_s"], round(1 / c["dt_s"]), c["rpm"]): c
        for c in content["cells"]
        if c["scene"] == scene
    }
    steps, rpm = sorted(grid["steps_per_s"], reverse=True), sorted(grid["rpm"])

    def block(solver: str, velocity: float) -> MapBlock:
        rows = [[cells[solver, velocity, n, r] for r in rpm] for n in steps]
        limits = [(c["predicted_elastic_limit_dt_s"], c["predicted_limit_dt_s"]) for c in rows[0]]
        return MapBlock(
            title=f"{solver}, critical velocity {_velocity(velocity)}",
            statuses=[[c["status"] for c in row] for row in rows],
            limits_s=limits,
        )

    blocks = [[block(s, v) for v in sorted(grid["critical_velocity_m_s"])] for s in grid["solvers"]]
    files = stability_map(folder, f"stability-{scene}", blocks=blocks, steps_per_s=steps, rpm=rpm)
    return Figure(
        id=f"stability-{scene}",
        label=f"Stability, {scene}",
        caption="A sign for how each run ended: light may be read, dark has come apart. Lines: the longest stable step "
        "of the system made linear about static balance, solid without friction, dashed with it. An explicit method "
        "beyond the dashed line does not diverge: its friction chatters between bounds.",
        alt=_alt(scene, blocks, steps, rpm),
        file=files.picture,
        data=files.data,
        badge=Badge.SIMULATED,
    )


def _alt(scene: str, blocks: Sequence[Sequence[MapBlock]], steps: Sequence[int], rpm: Sequence[float]) -> str:
    """For each block how many runs are ok at each step."""
    said = []
    for block in (b for row in blocks for b in row):
        counts = ", ".join(
            f"1/{n} s {sum(s == 'ok' for s in line)}" for n, line in zip(steps, block.statuses, strict=True)
        )
        said.append(f"{block.title}: ok at {counts}")
    return f"Map of {scene}, runs that are ok out of {len(rpm)} speeds. {'; '.join(said)}."


def _limits(cells: Sequence[Row]) -> Table:
    """For each method: the longest step with every run ok, beside what linear theory gives."""
    columns = [Column(title="Method, critical velocity")]
    scenes = list(dict.fromkeys(c["scene"] for c in cells))
    for scene in scenes:
        columns += [
            Column(title=f"{scene}: ok at all speeds to", unit="1/s", format=".0f"),
            Column(title="stays with the converged run to", unit="1/s", format=".0f"),
            Column(title="limit, friction left out", unit="1/s", format=".0f"),
            Column(title="limit", unit="1/s", format=".3g"),
        ]
    rows = []
    for solver, velocity in dict.fromkeys((c["solver"], c["critical_velocity_m_s"]) for c in cells):
        row: list[Cell | float | str | None] = [f"{solver}, {_velocity(velocity)}"]
        for scene in scenes:
            own = [
                c for c in cells if (c["scene"], c["solver"], c["critical_velocity_m_s"]) == (scene, solver, velocity)
            ]
            row += [
                _longest(own, lambda c: c["status"] == "ok"),
                _longest(own, lambda c: bool(c["holds"])),
                _per_s(own, "predicted_elastic_limit_dt_s"),
                _per_s(own, "predicted_limit_dt_s"),
            ]
        rows.append(row)
    return Table(
        id="stability-limits",
        label="Steps",
        caption="Longest step (as a divisor of a second) down to which all speeds are ok, and to which all stay with "
        "the converged run in cage and load even where energy does not close; beside them the least predicted limit.",
        columns=tuple(columns),
        rows=rows,
        notes=("A dash: no step of the map, or no limit found.",),
    )


def _velocity(m_s: float) -> str:
    return f"{m_s:g} m/s" if m_s >= 0.1 else f"{1e3 * m_s:g} mm/s"


def _longest(cells: Sequence[Row], good: Any) -> float | None:
    """Divisor of the longest step such that it and all shorter ones are good at every speed."""
    found = None
    for steps in sorted({round(1 / c["dt_s"]) for c in cells}, reverse=True):
        if not all(good(c) for c in cells if round(1 / c["dt_s"]) == steps):
            break
        found = float(steps)
    return found


def _per_s(cells: Sequence[Row], name: str) -> float | None:
    least = min((c[name] for c in cells if c[name] is not None), default=math.inf)
    return 1 / least if math.isfinite(least) else None


def _honesty(content: Mapping[str, Any]) -> Listing:
    counts, planted = content["counts"], content["planted"]
    flagged = [r for r in content["references"] if r["status"] != "ok"]
    missed = [p for p in planted if not p["caught"]]
    items = [
        _default(content["cells"]),
        f"**Caught by the runs themselves**: {counts['caught_by_the_run']} runs ended with a status and a reason.",
        f"**Not caught**: {counts['seen_by_comparison_only']} runs passed their own tests and are unlike the converged "
        "run; only the comparison shows it" + _worst(content["cells"]),
        f"**Flagged though cage and load are right**: {counts['flagged_with_cage_and_load_right']} runs, in which "
        "friction chatters so that energy does not close.",
        f"**Planted failures** (Euler at 2 and 4, Heun at 4 times the paper's step, 710 and 3000 rpm): "
        f"{len(planted) - len(missed)} of {len(planted)} caught by the runs themselves.",
        f"**False alarms on converged runs**: {len(flagged)} of {len(content['references'])}.",
    ]
    return Listing(items=tuple(items))


def _default(cells: Sequence[Row]) -> str:
    """How the default solver fares at its default step."""
    solver = paper_scene().solver
    own = [c for c in cells if c["solver"] == solver.name and math.isclose(c["dt_s"], solver.step_s, rel_tol=1e-6)]
    text = f"**The default** ({solver.name} at 1/{1 / solver.step_s:.0f} s): "
    text += f"ok in {sum(c['status'] == 'ok' for c in own)} of {len(own)} cells"
    failed = [
        f"{c['scene']}, {c['rpm']:g} rpm, {_velocity(c['critical_velocity_m_s'])}: {c['status']} (cage "
        f"{c['cage_error'] or math.nan:.2%} off, load {c['load_part'] or math.nan:.2f} times)"
        for c in own
        if c["status"] != "ok"
    ]
    return f"{text}; not in {'; '.join(failed)}." if failed else f"{text}."


def _worst(cells: Sequence[Row]) -> str:
    unlike = [c for c in cells if c["status"] == "unlike-reference"]
    if not unlike:
        return "."
    cage = max(c["cage_error"] for c in unlike)
    loads = [c["load_part"] for c in unlike]
    return (
        f" (cage at most {cage:.1%} off; load on the rollers {min(loads):.2f} to {max(loads):.2f} times the "
        "converged run's)."
    )
