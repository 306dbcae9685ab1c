"""How often faults were diagnosed correctly, by every method, and whether the probabilities hold; as last stored."""

from functools import partial

from srbval.report.blocks import Block, Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of
from srbval.studies.diagnosis.figure import reliability_plot
from srbval.studies.diagnosis.study import ALL

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """Counts by method; the reliability diagram of the probabilities."""
    result = results.get("diagnosis")
    if result is None:
        return TEXTS.section(appendix=(missing("diagnosis"),))
    rows, found = [row for row in result.content["confusions"] if row["dataset"] == ALL], result.content["naming"]
    blocks: tuple[Block, ...] = (
        TEXTS.paragraph("naming", rows=rows),
        origin_of(result),
        TEXTS.table("fault-naming", rows),
        TEXTS.paragraph("probabilities", found=found),
        TEXTS.figure("naming-reliability", partial(reliability_plot, rows=found["reliability"]), found=found),
    )
    return TEXTS.section(appendix=blocks)


PAGE = Page(name="diagnosis", place=120.1, results=("diagnosis",), section=section)
