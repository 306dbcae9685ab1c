"""The rig's own scene against the rig's cage speed, with the ranges of its inputs, and in which band both are read."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.evidence.stored import ShownResult
from srbval.report.blocks import Block
from srbval.report.content.names import missing, origin_of
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("rig_scene")


def rig_scene_section(result: ShownResult, bands: ShownResult) -> Section:
    """Comparison error against validation uncertainty for each record; what each input does to the first; `bands`."""
    if not result.content:
        return TEXTS.section(TEXTS.paragraph("intro"), missing(result))
    studies = result.content["studies"]
    return TEXTS.section(
        TEXTS.paragraph("intro"),
        origin_of(result),
        TEXTS.table("rig-scene-table", studies),
        TEXTS.table("rig-inputs-table", studies[0]["effects"], study=studies[0]),
        *_bands(bands, studies),
    )


def _bands(result: ShownResult, studies: Sequence[Mapping[str, Any]]) -> Iterator[Block]:
    """Model and rig in both of the paper's bands, and what is not as on the rig."""
    if not result.content:
        yield missing(result)
        return
    content = result.content
    yield TEXTS.paragraph("bands", served=content["served"], band_hz=content["band_hz"])
    yield origin_of(result)
    yield TEXTS.table("rig-bands-table", content["rows"])
    slow = [study for study in studies if study["uncertainty_pct"] is None]
    yield TEXTS.paragraph("open", drive_w=content["drive_w"], slow=slow)
