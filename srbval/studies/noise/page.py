"""Down to which ratio of signal to noise the lines are found."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from srbval.report.blocks import Block
from srbval.report.section_texts import Texts
from srbval.studies.appendix_page import appendix_page

Row = Mapping[str, Any]


def blocks(texts: Texts, content: Row) -> Iterator[Block]:
    """The lowest ratios in words, and all of them in a table."""
    rows = content["rows"]
    ratios = sorted({row["snr_db"] for row in rows}, key=lambda ratio: -math.inf if ratio is None else -ratio)
    clean = {row["state"]: row for row in rows if row["snr_db"] is None}
    found: dict[tuple[str, str], dict[float | None, Row]] = {}
    for row in rows:
        if row["snr_db"] is not None:
            own: dict[float | None, Row] = {None: clean[row["state"]]} if row["state"] in clean else {}
            found.setdefault((row["state"], row["colour"]), own)[row["snr_db"]] = row
    shown = [{"state": s, "colour": c, "found": of, "lowest_db": _lowest_db(of)} for (s, c), of in found.items()]
    yield texts.paragraph("noise", studies=shown)
    yield texts.table("noise-table", shown, ratios=ratios)


def _lowest_db(found: Mapping[float | None, Row]) -> float | None:
    """The lowest ratio at which, as at all higher ones, every draw still found the line."""
    ratios = {ratio: row["found"] < row["draws"] for ratio, row in found.items() if ratio is not None}
    lost = max((ratio for ratio, some in ratios.items() if some), default=-math.inf)
    return min((ratio for ratio in ratios if ratio > lost), default=None)


PAGE = appendix_page(
    __package__, 125, blocks, data=lambda content: {"detection_under_noise": content.get("rows", [])}
)  # fmt: skip
