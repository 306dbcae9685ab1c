"""The rig's own scene against the rig's cage speed, with the ranges of its inputs."""

from srbval.evidence.stored import ShownResult
from srbval.report.content.names import missing, origin_of
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("rig_scene")


def rig_scene_section(result: ShownResult) -> Section:
    """Comparison error against validation uncertainty for each record, and what each input does to the first."""
    if not result.content:
        return TEXTS.section(TEXTS.paragraph("intro"), missing(result))
    studies = result.content["studies"]
    return TEXTS.section(
        TEXTS.paragraph("intro"),
        origin_of(result),
        TEXTS.table("rig-scene-table", studies),
        TEXTS.table("rig-inputs-table", studies[0]["effects"], study=studies[0]),
    )
