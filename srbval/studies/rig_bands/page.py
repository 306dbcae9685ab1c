"""Model and rig in both of the paper's bands, from the stored study."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.studies.appendix_page import missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """Whether one band serves both, and what the scene of the rig leaves open."""
    result = results.get("rig_bands")
    if result is None:
        return TEXTS.section(appendix=(missing("rig_bands"),))
    content = result.content
    return TEXTS.section(
        appendix=(
            TEXTS.paragraph("bands", served=content["served"], band_hz=content["band_hz"]),
            origin_of(result),
            TEXTS.table("rig-bands-table", content["rows"]),
            TEXTS.paragraph("open", drive_w=content["drive_w"]),
        )
    )


PAGE = Page(
    name="rig_bands", place=44.1, results=("rig_bands",), section=section,
    data=lambda results: {"rig_bands": results.content("rig_bands").get("rows", [])},
)  # fmt: skip
