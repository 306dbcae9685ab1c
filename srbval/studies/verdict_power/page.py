"""How often each verdict is given on simulated rigs, by the planted error."""

from srbval.studies.appendix_page import appendix_page

PAGE = appendix_page(
    __package__, 115,
    lambda texts, content: (
        texts.paragraph("intro", content=content), texts.table("verdict-power-table", content["rows"])
    ),
    data=lambda content: {"verdict_power": content.get("rows", [])},
)  # fmt: skip
