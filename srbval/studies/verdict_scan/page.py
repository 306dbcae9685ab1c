"""What would be stated of the cage ratio with each input alone over its range; reading and numerics of each record."""

from srbval.studies.appendix_page import appendix_page

PAGE = appendix_page(
    __package__, 115,
    lambda texts, content: (texts.paragraph("intro"), texts.table("verdict-scan-table", content["rows"])),
    data=lambda content: {"verdict_scan": content.get("rows", [])},
)  # fmt: skip
