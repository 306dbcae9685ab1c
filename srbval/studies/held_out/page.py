"""The planner's predicted errors against measured ones on drawn scenes, as last stored."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """How many predictions held, by model and question."""
    result = results.get("held_out")
    if result is None:
        return TEXTS.section(appendix=(missing("held_out"),))
    tallies = result.content["tallies"]
    return TEXTS.section(
        appendix=(
            TEXTS.paragraph("held-out", total=tallies[-1]),
            origin_of(result),
            TEXTS.table("held-out-table", tallies, seconds=result.content["seconds"]),
        )
    )


PAGE = Page(name="held_out", place=50.1, results=("held_out",), section=section)
