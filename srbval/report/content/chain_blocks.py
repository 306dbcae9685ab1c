"""The one pass from record to envelope spectrum beside the paper's chain of library calls, from the stored bench."""

from __future__ import annotations

from typing import Any

from srbval.report.table import Column, Table


def chain_table(rows: list[dict[str, Any]]) -> Table:
    """How far apart the two are, in which figure, and which of them is off; what an older result lacks is a dash."""
    return Table(
        id="reading-chains",
        label="One pass",
        caption="From record to envelope in one transform and back, less the usual chain of library calls (two-way "
        "Butterworth filter, Hilbert transform, modulus), on white noise, both without the ends that are dropped. "
        "Largest differences over the largest value; lines are those of the squared envelope's spectrum, the fault "
        "line over its own height. The truth is a record three times as long.",
        columns=(
            Column(title="Band", unit="Hz"),
            Column(title="One pass less truth", format=".1e"),
            Column(title="Chain less truth", format=".1e"),
            Column(title="One pass less chain, squared envelope", format=".1e"),
            Column(title="Envelope", format=".1e"),
            Column(title="Envelope, RMS", format=".1e"),
            Column(title="Lines of noise", format=".1e"),
            Column(title="A fault line", format=".1e"),
            Column(title="Below 1e-4 from the ends on", unit="s", format=".2f"),
        ),
        rows=[
            [
                f"{row['low_hz']:g} to {row['high_hz']:g}",
                row["one_pass"],
                row["papers_chain"],
                row["one_pass_less_chain"],
                row.get("envelope_less_chain"),
                row.get("envelope_rms_less_chain"),
                row.get("lines_less_chain"),
                row.get("fault_line_less_chain"),
                row.get("agree_beyond_s"),
            ]
            for row in rows
        ],
        notes=(
            "A filtered record is cut off at both ends; the chain's Hilbert transform carries that inwards as 1/t. The "
            "one pass has a single kernel, which dies out with the filter: where the two differ, the chain is off.",
        ),
    )
