"""What would be stated of the cage ratio with each open input alone over its range."""

from srbval.evidence.stored import ShownResult
from srbval.report.content.names import missing, origin_of
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("verdict_scan")


def verdict_scan_section(result: ShownResult) -> Section:
    """One row for each input, reading and numerics of each record."""
    if not result.content:
        return TEXTS.section(appendix=(TEXTS.paragraph("intro"), missing(result)))
    rows = result.content["rows"]
    table = TEXTS.table("verdict-scan-table", rows)
    return TEXTS.section(appendix=(TEXTS.paragraph("intro"), origin_of(result), table))
