"""Which reading shows what the paper describes, and which harmonic of BPFO is missing; as last stored."""

from collections.abc import Iterator, Mapping
from typing import Any

from srbval.report.blocks import Block
from srbval.report.pages import appendix_page
from srbval.report.section_texts import Texts


def blocks(texts: Texts, content: Mapping[str, Any]) -> Iterator[Block]:
    """Impulses by reading; the missing harmonic on each model at the paper's bump, and on one over bump heights."""
    by_model, trains = content["by_model"], content["impulse_trains"]
    sides = {"pulses": ("impulse", "planar"), "clicks": ("kinematic",), "full": ("full",)}
    missing = {side: [row for row in by_model if row["model"] in models] for side, models in sides.items()}
    yield texts.paragraph("readings", trains=trains)
    yield texts.table("impulse-trains", trains)
    yield texts.paragraph(
        "missing-harmonic", patterns=content, missing=missing,
        harmonics=lambda rows, band: texts.text("harmonics", values=[row[band] for row in rows if row[band]]),
    )  # fmt: skip
    yield texts.table("pattern-models-table", by_model, patterns=content)
    yield texts.table("pattern-table", content["by_height"], patterns=content)


PAGE = appendix_page(__package__, 90, blocks, data=lambda content: {"paper_figures": content})
