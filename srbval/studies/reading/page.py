"""How well frequencies are read, and what is found where nothing is wrong, as last stored."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from srbval.report.blocks import Block
from srbval.report.pages import study_page
from srbval.report.prose import Prose

COVERAGE = (0.92, 0.98)  # of a 95 % interval, as counted in some hundred lines


def by_length(rows: list[Mapping[str, Any]]) -> pd.DataFrame:
    """Coverage and width of the stated intervals by length of the record and jitter, over all detected lines."""
    groups = pd.DataFrame(rows).groupby(["turns", "jitter"], as_index=False)
    found = groups.agg({"detected": "sum", "covered": "sum", "rmse_over_bound": "median", "ci95_over_error": "median"})
    return found.assign(coverage=found["covered"] / found["detected"])


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """Error against the bound and coverage of the intervals; alarms on records without a fault."""
    lengths, without = by_length(content["accuracy"]), pd.DataFrame(content["without_fault"])
    steady = [row["rmse_over_bound"] for row in content["accuracy"] if row["jitter"] == 0 and row["snr_db"] > 30]
    covered = lengths["coverage"].between(*COVERAGE)
    values = {"low": min(steady), "high": max(steady), "covered": int(covered.sum()), "of": len(lengths)}
    values |= {"least": lengths["coverage"].min(), **without[["records", "named", "line_detected"]].sum()}
    yield prose.paragraph("intro", **values)
    columns = {"turns": ("Revolutions", "", ".0f"), "jitter": ("Jitter", "", ".1%"), "detected": ("Lines", "", "d")}
    columns |= {"rmse_over_bound": ("Error over bound", "", ".2f"), "coverage": ("Coverage", "", ".1%")}
    yield prose.table("reading-by-length", lengths, columns | {"ci95_over_error": ("Width over error", "", ".2f")})
    shares = {"noise_below": "Noise", "rank_below": "Rank", "stated_below": "Stated"}
    columns = {"background": ("Background", "", ""), "records": ("Records", "", "d"), "named": ("Fault named", "", "d")}
    columns |= {"line_detected": ("Line detected", "", "d"), "placebos": ("Placebo lines", "", "d")}
    yield prose.table("reading-without-fault", without, columns | {k: (v, "", ".1%") for k, v in shares.items()})


PAGE = study_page(__package__, 105, blocks, data=lambda content: {"reading": content["accuracy"]})
