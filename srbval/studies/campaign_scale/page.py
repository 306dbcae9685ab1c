"""What a campaign costs besides its simulations, from the stored study."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)
WORKERS = "workers_before_the_coordinator_is_full"


def section(results: StoredResults) -> Section:
    """What was measured and its extrapolation."""
    result = results.get("campaign_scale")
    if result is None:
        return TEXTS.section(appendix=(missing("campaign_scale"),))
    rows = result.content["extrapolated"]
    return TEXTS.section(
        appendix=(
            origin_of(result),
            TEXTS.paragraph("scale", measured=result.content["measured"], workers=rows[0][WORKERS]),
            TEXTS.table("scale-table", rows),
        )
    )


PAGE = Page(
    name="campaign_scale", place=125.1, results=("campaign_scale",), section=section,
    data=lambda results: {"campaign_scale": results.content("campaign_scale").get("extrapolated", [])},
)  # fmt: skip
