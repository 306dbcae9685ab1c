"""The planner's predicted errors against measured ones on drawn scenes, by model and question."""

from srbval.studies.appendix_page import appendix_page

PAGE = appendix_page(
    __package__, 50.1,
    lambda texts, content: (
        texts.paragraph("held-out", total=content["tallies"][-1]),
        texts.table("held-out-table", content["tallies"], seconds=content["seconds"]),
    ),
)  # fmt: skip
