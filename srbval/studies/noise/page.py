"""Detection under noise, and what a campaign costs, from the stored studies."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from srbval.report.blocks import Block
from srbval.report.findings.stored import ShownResult
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import missing, origin_of

TEXTS = Texts("campaigns")
WORKERS = "workers_before_the_coordinator_is_full"


def campaign_section(noise: ShownResult, scale: ShownResult) -> Section:
    """The study of noise and the table of scale; what is missing is said."""
    return TEXTS.section(
        appendix=(
            *(_noise(noise, noise.content["rows"]) if noise.content else (missing(noise),)),
            *(_scale(scale, scale.content) if scale.content else (missing(scale),)),
        )
    )


def _noise(result: ShownResult, rows: list[dict[str, Any]]) -> Iterator[Block]:
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


def _scale(result: ShownResult, content: Mapping[str, Any]) -> Iterator[Block]:
    rows = content["extrapolated"]
    yield origin_of(result)
    yield TEXTS.paragraph("scale", measured=content["measured"], workers=rows[0][WORKERS])
    yield TEXTS.table("scale-table", rows)
