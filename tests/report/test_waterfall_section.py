"""The waterfall's section: each step's errors in words, what is not shown, what stands where nothing is stored."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import Callout, Figure
from srbval.report.findings.stored import ShownResult, shown_result
from srbval.report.table import Table
from srbval.storage.stored_result import StoredResult
from srbval.studies.waterfall.page import waterfall_section

ORIGIN = {"made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc", "command": "waterfall",
          "machine": {"processor": "A & <B>", "usable_cores": 2}}  # fmt: skip


def measure(step: str, record: str, name: str, error: float | None, **changes: Any) -> dict[str, Any]:
    unit = "%" if name == "cage ratio" else "dB"
    width = None if error is None else 0.5
    return {"step": step, "record": record, "used_for": "withheld", "measure": name, "error": error, "shown": 1,
            "uncertainty": width, "unit": unit, "compared": 1} | changes  # fmt: skip


@pytest.fixture
def stored() -> ShownResult:
    rows = [
        measure("first", "OR", "cage ratio", 0.18), measure("first", "OR", "increment", None, shown=0),
        measure("last", "OR", "cage ratio", -0.01, used_for="fit"),
        measure("last", "OR", "increment", 7.25, used_for="fit", shown=2, compared=4),
    ]  # fmt: skip
    return shown_result("waterfall", StoredResult(path=Path("waterfall.json"), content=ORIGIN | {"measures": rows}))


def test_every_step_has_its_errors(stored: ShownResult, tmp_path: Path) -> None:
    section = waterfall_section(stored)
    (table,) = (block for block in section.all_blocks if isinstance(block, Table))
    assert [column.title for column in table.columns][3:] == ["cage ratio, %", "increment, dB"]
    texts = [[cell.value for cell in row] for row in table.rows]
    assert texts == [
        ["first", "OR", "withheld", "+0.180 [0.500]", "not shown"],
        ["last", "OR", "fit", "-0.010 [0.500]", "+7.2 [0.5], 2 of 4"],
    ]
    (figure,) = (block for block in section.blocks if isinstance(block, Figure))
    assert "cage ratio goes from +0.180 [0.500] to -0.010 [0.500]" in figure.alt
    with figure.draw(tmp_path, figure.id).data.open(encoding="utf-8") as file:
        assert [row["error"] for row in csv.DictReader(file)] == ["0.18", "", "-0.01", "7.25"]


def test_without_a_stored_result_the_command_is_named(stored: ShownResult) -> None:
    (callout,) = waterfall_section(replace(stored, content=None)).blocks
    assert isinstance(callout, Callout)
    assert stored.command in callout.text
