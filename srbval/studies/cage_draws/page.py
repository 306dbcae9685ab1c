"""The model's cage ratio over its inputs: drawn together, and each alone."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.studies.appendix_page import missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """What the scene of the rig is; in the appendix what every variant's draws and single inputs do."""
    result = results.get("cage_draws")
    if result is None:
        return TEXTS.section(TEXTS.paragraph("intro"), missing("cage_draws"))
    variants = result.content["variants"]
    tables = [
        TEXTS.table("cage-inputs-table", one["effects"], id=f"cage-inputs-{number}", variant=one)
        for number, one in enumerate(variants, start=1)
    ]
    draws = TEXTS.table("cage-draws-table", [(v, record) for v in variants for record in v["records"]])
    return TEXTS.section(TEXTS.paragraph("intro"), appendix=(origin_of(result), draws, *tables))


PAGE = Page(
    name="cage_draws", place=44, results=("cage_draws",), section=section,
    data=lambda results: {"cage_draws": results.content("cage_draws").get("variants", [])},
)  # fmt: skip
