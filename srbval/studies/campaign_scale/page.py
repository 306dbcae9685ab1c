"""What a campaign costs besides its simulations: what was measured and its extrapolation."""

from srbval.studies.appendix_page import appendix_page

WORKERS = "workers_before_the_coordinator_is_full"
PAGE = appendix_page(
    __package__, 125.1,
    lambda texts, content: (
        texts.paragraph("scale", measured=content["measured"], workers=content["extrapolated"][0][WORKERS]),
        texts.table("scale-table", content["extrapolated"]),
    ),
    data=lambda content: {"campaign_scale": content.get("extrapolated", [])},
)  # fmt: skip
