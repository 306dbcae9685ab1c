"""How often the verdict by record is wrong on simulated rigs, from the stored study."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """Shares of rigs and records, by truth."""
    result = results.get("record_verdicts")
    if result is None:
        return TEXTS.section(appendix=(missing("record_verdicts"),))
    table = TEXTS.table("verdict-rates", result.content["rows"], truths=result.content["truths"])
    return TEXTS.section(appendix=(origin_of(result), table))


PAGE = Page(name="record_verdicts", place=110.1, results=("record_verdicts",), section=section)
