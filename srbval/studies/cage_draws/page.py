"""The model's cage ratio over its inputs: drawn together, and each alone."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults, missing, origin_of
from srbval.report.section_texts import Texts

TEXTS = Texts.of_study(__package__)
FRICTION = "critical velocity of friction"


def section(results: StoredResults) -> Section:
    """What the scene of the rig is; in the appendix what every variant's draws and single inputs do."""
    result = results.get("cage_draws")
    if result is None:
        return TEXTS.section(TEXTS.paragraph("intro"), missing("cage_draws"))
    variants = result.content["variants"]
    tables = [
        TEXTS.table("cage-inputs-table", one["effects"], id=f"cage-inputs-{number}", variant=one)
        for number, one in enumerate(variants, start=1)
    ]
    profile = TEXTS.table("friction-profile", list(_profile(variants)), records=variants[0]["records"])
    draws = TEXTS.table("cage-draws-table", [(v, record) for v in variants for record in v["records"]])
    return TEXTS.section(TEXTS.paragraph("intro"), appendix=(origin_of(result), draws, profile, *tables))


def _profile(variants: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """By critical velocity of friction, from dry to an oil film: the nominal ratio of every record."""
    of = [(one["form"], e) for one in variants for e in one["effects"] if e["name"] == FRICTION]
    for form, effect in of:
        if form != "continuous contacts":
            for value, *ratios in zip(effect["values"], *effect["ratios"], strict=True):
                yield {"form": form, "value": value, "ratios": ratios}


PAGE = Page(
    name="cage_draws", place=44, results=("cage_draws",), section=section,
    data=lambda results: {"cage_draws": results.content("cage_draws").get("variants", [])},
)  # fmt: skip
