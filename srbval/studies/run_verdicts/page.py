"""How often runs are right about themselves: counts by part of the grid, and every run whose verdict is wrong."""

from srbval.studies.appendix_page import appendix_page

PAGE = appendix_page(
    __package__, 48.1,
    lambda texts, content: (
        texts.paragraph("verdicts", **{name: content[name] for name in ("counts", "seed", "tolerance")}),
        texts.table("own-verdicts", content["parts"]),
        texts.listing(
            "wrong-verdicts", wrong=[run for run in content["runs"] if run["falsely_ok"] or run["falsely_failed"]]
        ),
    ),
)  # fmt: skip
