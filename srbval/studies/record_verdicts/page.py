"""How often the verdict by record is wrong on simulated rigs: shares of rigs and records, by truth."""

from srbval.studies.appendix_page import appendix_page

PAGE = appendix_page(
    __package__, 110.1,
    lambda texts, content: [texts.table("verdict-rates", content["rows"], truths=content["truths"])],
)  # fmt: skip
