"""Campaigns: how detection falls with noise, and what very many cases cost; both from stored results."""

from __future__ import annotations

import math
from typing import Any

from srbval.report.badges import Badge
from srbval.report.blocks import Block, Paragraph
from srbval.report.content.kept_result import missing, origin_of
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.report.table import Cell, Column, Table
from srbval.storage.stored_result import CAMPAIGN_SCALE, NOISE_STUDY, StoredResult

WORKERS = "workers_before_the_coordinator_is_full"


def campaign_section(noise: StoredResult | None, scale: StoredResult | None) -> Section:
    """The study of noise and the table of scale; what is missing is said."""
    return Section(
        id="campaigns",
        title="Many cases: detection under noise, and what a campaign costs",
        blocks=(
            *(_noise(noise) if noise else (missing(NOISE_STUDY),)),
            *(_scale(scale) if scale else (missing(CAMPAIGN_SCALE),)),
        ),
    )


def _noise(kept: StoredResult) -> tuple[Block, ...]:
    rows = kept.content["rows"]
    ratios = sorted({r["snr_db"] for r in rows}, key=lambda r: -math.inf if r is None else -r)
    cells = {(r["state"], r["colour"], r["snr_db"]): _found(r) for r in rows}
    clean = {r["state"]: _found(r) for r in rows if r["snr_db"] is None}
    cells |= {(r["state"], r["colour"], None): clean[r["state"]] for r in rows if r["state"] in clean}
    table = Table(
        id="noise-table",
        label="Noise",
        caption="Fault lines of the paper's scene under added noise. The ratio is of variances over all frequencies; a "
        "line is found where its comb passes the false-alarm test of every record.",
        columns=(
            Column(title="Defect"),
            Column(title="Noise"),
            *(Column(title="none" if r is None else f"{r:g} dB", format=".3g") for r in ratios),
        ),
        rows=[
            [Cell(value=state, badge=Badge.SIMULATED), colour, *(cells.get((state, colour, r)) for r in ratios)]
            for state, colour in dict.fromkeys((r["state"], r["colour"]) for r in rows if r["snr_db"] is not None)
        ],
        notes=(
            "Line over noise in the envelope spectrum; below it in how many draws the line was found and, if any, the "
            "largest shift of a found line.",
        ),
    )
    return origin_of(kept), Paragraph(_reading(rows)), table


def _found(row: dict[str, Any]) -> Cell:
    """Line over noise, with how often it was found and how far it moved."""
    moved = row["deviation_pct"]
    note = f"{row['found']} of {row['draws']}" + ("" if not moved else f", {moved:.2g} %")
    return Cell(value=row["line_snr"], note=note)


def _reading(rows: list[dict[str, Any]]) -> str:
    """For each defect and colour the lowest ratio at which every draw still found the line."""
    parts = []
    for state, colour in dict.fromkeys((r["state"], r["colour"]) for r in rows if r["snr_db"] is not None):
        own = [r for r in rows if (r["state"], r["colour"]) == (state, colour)]
        lost = [r["snr_db"] for r in own if r["found"] < r["draws"]]
        kept = [r["snr_db"] for r in own if r["snr_db"] > max(lost, default=-float("inf"))]
        at = f"down to **{min(kept):g} dB**" if kept else "at **no ratio tried**"
        noise = "white noise" if colour == "white" else f"the noise of {literal(colour)}"
        parts.append(f"{state} race in {noise}: {at}")
    return "Every draw finds the fault line, " + "; ".join(parts) + "."


def _scale(kept: StoredResult) -> tuple[Block, ...]:
    measured = kept.content["measured"]
    reckoned = kept.content["reckoned"]
    table = Table(
        id="scale-table",
        label="Scale",
        caption="What many cases of five seconds on one core cost beside their simulations, in proportion to what was "
        "measured; result files without signals.",
        columns=(
            Column(title="Cases", format="d"),
            Column(title="Workers", format="d"),
            Column(title="Planning", unit="s", format=".3g"),
            Column(title="Simulations", unit="h", format=".3g"),
            Column(title="Coordinator's processor time", unit="s", format=".3g"),
            Column(title="Coordinator's memory", unit="MB", format=".0f"),
            Column(title="Files a folder", format=".0f"),
            Column(title="Results", unit="GB", format=".3g"),
            Column(title="Plan and journal", unit="GB", format=".3g"),
        ),
        rows=[
            [
                row["cases"], row["workers"], row["planning_s"], row["simulation_s"] / 3600, row["coordinator_s"],
                None if row["peak_bytes"] is None else row["peak_bytes"] / 1e6, row["files_a_folder"],
                row["result_bytes"] / 1e9, row["plan_and_journal_bytes"] / 1e9,
            ]
            for row in reckoned
        ],
    )  # fmt: skip
    text = (
        f"Measured with {measured['cases']:,} tiny cases on engine {measured['engine']}: planning "
        f"{measured['planning_s']:.1f} s, {1e3 * measured['coordinator_s']:.2f} ms of the coordinator's processor time "
        f"a case. **The coordinator is the first limit**: one keeps about {reckoned[0][WORKERS]:,} workers busy. "
        "Planning and its memory come next, both in proportion to the cases; then the number of files, spread over 256 "
        "folders. Only a few cases a worker are with the scheduler at a time, workers write their own results, and "
        "what comes back is a line. Beyond that, several campaigns with a part of the axes each run side by side."
    )
    return origin_of(kept), Paragraph(text), table
