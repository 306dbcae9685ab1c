"""The rig's own scene against the rig's records: the cage speed that follows from its inputs alone."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.studies.appendix_page import missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """Errors against uncertainties of the cage speed; the effect of each input in the appendix."""
    result = results.get("rig_inputs")
    if result is None:
        return TEXTS.section(TEXTS.paragraph("intro"), missing("rig_inputs"))
    studies = result.content["studies"]
    inputs = TEXTS.table("rig-inputs-table", studies[0]["effects"], study=studies[0])
    return TEXTS.section(
        TEXTS.paragraph("intro"), TEXTS.table("rig-scene-table", studies), appendix=(origin_of(result), inputs)
    )


PAGE = Page(
    name="rig_inputs", place=44, results=("rig_inputs",), section=section,
    data=lambda results: {"rig_scene": results.content("rig_inputs").get("studies", [])},
)  # fmt: skip
