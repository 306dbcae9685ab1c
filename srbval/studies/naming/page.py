"""How often faults are named correctly, by method, as last stored."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from srbval.report.blocks import Block
from srbval.report.pages import study_page
from srbval.report.prose import Prose

GRADED = {
    "grade": ("Grade", "", ""),
    "part": ("Part", "", ""),
    "records": ("Records", "", "d"),
    "right": ("Right", "", "d"),
    "wrong": ("Wrong", "", "d"),
    "undecided": ("Undecided", "", "d"),
    "nothing_found": ("Nothing found", "", "d"),
    "first_right": ("Ranked first, right", "", "d"),
    "public_right": ("Public tool, right", "", "d"),
    "public_wrong": ("Public tool, wrong", "", "d"),
}
COUNTS = {"right": "Right", "wrong": "Wrong", "none": "None", "healthy_called": "Healthy called"}


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """Counts by method over all records, and by class for the record alone."""
    methods = pd.DataFrame(content["methods"])
    every, alone = methods[methods["by"] == "all"], methods[methods["name"] == "record alone"]
    sure = pd.DataFrame([{"part": one["called"]["record alone"], **one} for one in content["records"]]).dropna(
        subset="part"
    )
    values = {"said": sure["probability"].mean(), "share": (sure["part"] == sure["state"]).mean(), "named": len(sure)}
    yield prose.paragraph("intro", faulty=every["faulty"].max(), healthy=every["healthy"].max(), **values)
    counts = {name: (title, "", "d") for name, title in COUNTS.items()}
    yield prose.table("fault-naming", every, {"name": ("Method", "", "")} | counts)
    yield prose.table("naming-groups", alone[alone["by"] != "all"], {"of": ("Set or class", "", "")} | counts)
    if graded := content.get("graded"):
        yield prose.table("graded", pd.DataFrame(graded["table"]), GRADED, run=graded["run"])


PAGE = study_page(__package__, 120.1, blocks, data=lambda content: {"naming": content["methods"]})
