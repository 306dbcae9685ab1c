"""How well frequencies are read: the stored Monte-Carlo of ``srbval bench --reading``."""

from __future__ import annotations

from typing import Any

from srbval.report.blocks import Block, Paragraph
from srbval.report.content.chain_blocks import chain_table
from srbval.report.content.kept_result import missing, origin_of
from srbval.report.model import Section
from srbval.report.table import Column, Table
from srbval.storage.stored_result import READING, StoredResult

# A line this far above the noise is strong: what is asked of an error is asked from here on.
STRONG_DB = 16.0


def reading_section(kept: StoredResult | None) -> Section:
    """Error against the Cramer-Rao bound, coverage of the stated intervals, false alarms; or how to measure them."""
    blocks = _blocks(kept) if kept else (missing(READING),)
    return Section(id="reading", title="How well a frequency is read", blocks=blocks)


def _blocks(kept: StoredResult) -> tuple[Block, ...]:
    content = kept.content
    return (
        origin_of(kept),
        Paragraph(
            "Made-up combs of five harmonics in white noise, the spacing of impacts jittered at random; nothing is "
            "measured. The truth is the rate from which the impacts stray, not the mean that a record happens to have. "
            f"{_said(content['accuracy'])}"
        ),
        _accuracy(content["accuracy"]),
        _alarms(content["false_alarms"]),
        *((chain_table(content["chains"]),) if content.get("chains") else ()),
    )


def _said(rows: list[dict[str, Any]]) -> str:
    steady = [row for row in rows if row["jitter"] == 0]
    strong = [row["rmse_over_bound"] for row in steady if row["weakest_db"] >= STRONG_DB]
    weak = [row for row in steady if row["weakest_db"] < STRONG_DB]
    off = [row for row in rows if not 0.92 <= row["coverage"] <= 0.98]
    return (
        f"Without jitter the error is **{min(strong):.2f} to {max(strong):.2f} times the Cramer-Rao bound** where "
        f"every harmonic stands {STRONG_DB:g} dB or more above the noise{_of_weak(weak)}. The 95 % interval covers "
        f"between 92 and 98 % in **{len(rows) - len(off)} of {len(rows)}** cells, from "
        f"{100 * min(row['coverage'] for row in rows):.1f} to {100 * max(row['coverage'] for row in rows):.1f} % in "
        "all; a frequency is stated, and counted here, only of lines that are detected."
    )


def _of_weak(rows: list[dict[str, Any]]) -> str:
    if not rows:
        return ""
    worst = max(rows, key=lambda row: row["rmse_over_bound"])
    return (
        f"; where some do not, up to {worst['rmse_over_bound']:.2f}, of which a fit that is told the noise, each "
        f"harmonic's strength and that nothing slips still has {worst['informed_over_bound']:.2f}"
    )


def _accuracy(rows: list[dict[str, Any]]) -> Table:
    return Table(
        id="reading-accuracy",
        label="Reading",
        caption="Error of the frequency read, and coverage of its stated 95 % interval. The bound is noise alone's, "
        "so that with jitter the error exceeds it. Informed: a fit that is told the noise, each harmonic's strength "
        "and that nothing slips, so that no other can be expected to come nearer.",
        columns=(
            Column(title="Record", unit="s", format="g"),
            Column(title="Line to noise, first", unit="dB", format="g"),
            Column(title="fifth", unit="dB", format=".0f"),
            Column(title="Jitter", unit="%", format="g"),
            Column(title="Detected", unit="%", format=".0f"),
            Column(title="Error over bound", format=".2f"),
            Column(title="Informed", format=".2f"),
            Column(title="Coverage", unit="%", format=".1f"),
            Column(title="Records", format="d"),
        ),
        rows=[
            [
                row["seconds"],
                row["snr_db"],
                row["weakest_db"],
                100 * row["jitter"],
                100 * row["detected"],
                row["rmse_over_bound"],
                row["informed_over_bound"],
                100 * row["coverage"],
                row["trials"],
            ]
            for row in rows
        ],
    )


def _alarms(rows: list[dict[str, Any]]) -> Table:
    return Table(
        id="reading-false-alarms",
        label="False alarms",
        caption="How often noise alone fell below a nominal false-alarm probability, over that probability.",
        columns=(
            Column(title="Noise"),
            Column(title="Harmonics", format="d"),
            Column(title="Nominal", format="g"),
            Column(title="Observed", format=".2g"),
            Column(title="Ratio", format=".2f"),
            Column(title="Records", format="d"),
        ),
        rows=[
            [row["noise"], row["harmonics"], row["nominal"], row["observed"], row["ratio"], row["records"]]
            for row in rows
        ],
    )
