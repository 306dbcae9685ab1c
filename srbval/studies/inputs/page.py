"""Effects of the uncertain inputs on the compared quantities, and the power of the verdicts."""

from collections.abc import Iterator, Mapping
from typing import Any

from srbval.comparison.comparison import STUDY, TOLERANCE
from srbval.report.blocks import Block
from srbval.report.pages import study_page
from srbval.report.prose import Prose


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """One table of effects, one of the power."""
    yield prose.paragraph("intro", **{f"{one['scene']}_draws": len(one["at"]) for one in content["variants"]})
    more = [{"mean": row["value"] + row["shift"], "most_by": most_by(row["shares"])} for row in content["effects"]]
    yield prose.table("inputs-effects", [row | one for row, one in zip(content["effects"], more, strict=True)])
    yield prose.paragraph("power", rigs=content["power"][0]["rigs"], between_pct=STUDY.between_pct, **vars(TOLERANCE))
    yield prose.table("inputs-power", content["power"])


def most_by(shares: Mapping[str, float]) -> str:
    """The two inputs that explain most of the variance on their own."""
    return ", ".join(
        f"{name} {100 * shares[name]:.0f} %" for name in sorted(shares, key=lambda name: -shares[name])[:2]
    )


PAGE = study_page(__package__, 44, blocks, data=lambda content: {"verdict_power": content["power"]})
