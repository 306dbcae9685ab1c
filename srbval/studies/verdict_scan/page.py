"""What would be stated of the cage ratio with each input alone over its range, from the stored study."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """One row for each input, reading and numerics of each record."""
    result = results.get("verdict_scan")
    if result is None:
        return TEXTS.section(appendix=(TEXTS.paragraph("intro"), missing("verdict_scan")))
    table = TEXTS.table("verdict-scan-table", result.content["rows"])
    return TEXTS.section(appendix=(TEXTS.paragraph("intro"), origin_of(result), table))


PAGE = Page(
    name="verdict_scan", place=115, results=("verdict_scan",), section=section,
    data=lambda results: {"verdict_scan": results.content("verdict_scan").get("rows", [])},
)  # fmt: skip
