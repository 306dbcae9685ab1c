"""How often runs are right about themselves, from the stored study."""

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)


def section(results: StoredResults) -> Section:
    """The counts, by part of the grid, and every run whose verdict is wrong."""
    result = results.get("run_verdicts")
    if result is None:
        return TEXTS.section(appendix=(missing("run_verdicts"),))
    content = result.content
    wrong = [run for run in content["runs"] if run["falsely_ok"] or run["falsely_failed"]]
    return TEXTS.section(
        appendix=(
            TEXTS.paragraph("verdicts", **{name: content[name] for name in ("counts", "seed", "tolerance")}),
            origin_of(result),
            TEXTS.table("own-verdicts", content["parts"]),
            TEXTS.listing("wrong-verdicts", wrong=wrong),
        )
    )


PAGE = Page(name="run_verdicts", place=48.1, results=("run_verdicts",), section=section)
