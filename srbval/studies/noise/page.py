"""Detection under noise, from the stored study."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from srbval.report.blocks import Block, Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of
from srbval.storage.stored_result import StoredResult

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """Down to which ratio of signal to noise the lines are found."""
    result = results.get("noise")
    return TEXTS.section(appendix=(missing("noise"),) if result is None else _blocks(result, result.content["rows"]))


def _blocks(result: StoredResult, rows: list[dict[str, Any]]) -> Iterator[Block]:
    ratios = sorted({row["snr_db"] for row in rows}, key=lambda ratio: -math.inf if ratio is None else -ratio)
    clean = {row["state"]: row for row in rows if row["snr_db"] is None}
    studies: dict[tuple[str, str], dict[Any, Any]] = {}
    for row in rows:
        if row["snr_db"] is not None:
            found = studies.setdefault((row["state"], row["colour"]), {None: clean.get(row["state"])})
            found[row["snr_db"]] = row
    shown: list[dict[str, Any]] = [
        {"state": state, "colour": colour, "found": {ratio: row for ratio, row in found.items() if row}}
        for (state, colour), found in studies.items()
    ]
    yield origin_of(result)
    yield TEXTS.paragraph("noise", studies=[{**study, "lowest_db": _lowest_db(study["found"])} for study in shown])
    yield TEXTS.table("noise-table", shown, ratios=ratios)


def _lowest_db(found: Mapping[float | None, Mapping[str, Any]]) -> float | None:
    """The lowest ratio at which, as at all higher ones, every draw still found the line."""
    lost = max((ratio for ratio, row in found.items() if ratio is not None and row["found"] < row["draws"]),
               default=-math.inf)  # fmt: skip
    return min((ratio for ratio in found if ratio is not None and ratio > lost), default=None)


PAGE = Page(
    name="noise", place=125, results=("noise",), section=section,
    data=lambda results: {"detection_under_noise": results.content("noise").get("rows", [])},
)  # fmt: skip
