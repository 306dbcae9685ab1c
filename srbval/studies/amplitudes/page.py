"""Report page of the study of amplitudes: errors of one-third-octave bands, and level errors too large for chance."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from srbval.comparison.comparison import VERDICT, Row
from srbval.report.blocks import Block
from srbval.report.figures.style import BLUE, SOFT, VERMILION, WIDE, Panel, PanelData, legend_above, new_axes
from srbval.report.pages import Page, StoredResults, record_words, stored_content
from srbval.report.prose import Prose

LOCKED, OUTCOME = "locked level", "prediction_outcome"
CHANCE = 0.05  # probability, over all records, that a level error of a correct model counts as unexplained


def unexplained(tests: Sequence[Row], locked: Sequence[Row]) -> str:
    """Sentence on the records whose level error is too large for chance, by the probability `level_p` in `tests`.

    `locked` contains the errors of each record in each band.
    """
    far = [one["record"] for one in tests if one["level_p"] < CHANCE / len(tests)]
    if not far:
        return "In no record does the level common to all bands deviate by more than the uncertainty."
    ends = pd.DataFrame(locked).groupby("record")["error"].agg(["min", "max"]).loc[far].itertuples()
    found = [f"{record_words(name)} (model over rig {low:+.0f} to {high:+.0f} dB)" for name, low, high in ends]
    return f"Open problem: the level of {' and '.join(found)} is not explained."


def draw_errors(rows: Sequence[Row]) -> PanelData:
    """Draw errors, with uncertainty, of the power that repeats with a fault's passages, by record and third octave."""
    ax = new_axes(WIDE)
    table = pd.DataFrame(rows).assign(band_hz=[float(one["quantity"].split()[1]) for one in rows])
    for number, (record, of) in enumerate(table.groupby("record", sort=False)):
        name, at = record_words(str(record)), of.band_hz * 1.03 ** (number - 1.5)
        color = VERMILION if "353" in name else BLUE
        ax.errorbar(at, of.error, of.uncertainty, label=name, fmt="os^v"[number % 4], color=color, ms=4)
    ax.axhspan(-VERDICT.near_db, VERDICT.near_db, color=SOFT, alpha=0.12, lw=0)
    ax.set(xscale="log", xlabel="One-third-octave band, Hz", ylabel="Model over rig, dB")
    bands = sorted(table.band_hz.unique())
    ax.set_xticks(bands, labels=[f"{hz:.0f}" for hz in bands])
    ax.minorticks_off()
    legend_above(ax)
    return ax.figure, table[["record", "band_hz", "rig", "model", "error", "uncertainty"]].to_dict("list")


def _blocks(prose: Prose, content: Mapping[str, Any]) -> Iterable[Block]:
    locked = [one for one in content["rows"] if one["kind"] == LOCKED]
    yield prose.figure("amplitude-errors", Panel(draw_errors, locked), near_db=VERDICT.near_db, **content["mounting"])
    yield prose.paragraph("counts", near_db=VERDICT.near_db, **content["counts"])
    yield prose.paragraph("open", conclusion=unexplained(content["tests"], locked))


def data(content: Mapping[str, Any], results: StoredResults) -> Mapping[str, Any]:
    """Results of the study for ``report.json``, by key."""
    outcome = dict(stored_content(results, OUTCOME))
    compared = [*content["rows"], *outcome.pop("comparisons", [])]
    found = {"amplitudes": content["counts"], "amplitude_levels": content["tests"], "comparisons": compared}
    return found | {"prediction_outcome": outcome}


PAGE = Page(__package__, 40, _blocks, data, more_results=(OUTCOME,))
