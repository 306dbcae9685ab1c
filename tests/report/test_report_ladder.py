from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from srbval.errors import DataError
from srbval.models.ladder import MODELS
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.questions import Question
from srbval.plan.table import load_calibration
from srbval.report import Figure
from srbval.report.findings.harmonics import HarmonicPattern, HarmonicPatterns
from srbval.report.findings.stored import shown_ladder, shown_results
from srbval.report.sections.ladder import ladder_section
from srbval.report.table import Table


def test_one_row_for_each_question_and_rung() -> None:
    rows = shown_ladder().rows
    calibrated = shipped_calibration().models
    assert {(row["question"], row["model"]) for row in rows} == {(q.value, m) for q in Question for m in calibrated}
    for row in rows:
        assert row["wall_per_simulated_s"] > 0
        assert row["unanswered"] <= row["scenes"]


def evidence() -> Any:
    rows = tuple(
        HarmonicPattern(
            model=model, roller_fit="play", height_mm=0.2, pulse_share=0.2, by_sinc=5.0, wide_band=None, paper_band=4.0
        )
        for model in MODELS
    )
    patterns = HarmonicPatterns(
        height_mm=0.2, swept_model="impulse", wide_band_hz=(300.0, 3300.0), paper_band_hz=(500.0, 1500.0),
        by_rung=rows, by_height=rows[:1],
    )  # fmt: skip
    return SimpleNamespace(
        ladder=shown_ladder(), rig_ladder=shown_ladder("rig"), results=shown_results(), patterns=patterns
    )


def test_the_section_shows_every_rung(tmp_path: Path) -> None:
    section = ladder_section(evidence())
    (figure,) = (block for block in section.all_blocks if isinstance(block, Figure))
    picture = figure.draw(tmp_path, figure.id).picture.read_text(encoding="utf-8")
    for model in shipped_calibration().models:
        assert model in picture
    tables = [block for block in section.all_blocks if isinstance(block, Table)]
    shown = [table.id for table in tables if table.id != "held-out-table"]
    assert shown == [
        "ladder-table",
        "rig-ladder-table",
        "amplitude-ladder-table",
        "pattern-rungs-table",
        "pattern-table",
    ]
    (rungs,) = (table for table in tables if table.id == "pattern-rungs-table")
    assert {row[0].value for row in rungs.cells} == set(MODELS)


def test_the_shipped_table_names_its_solver_and_machine() -> None:
    table = shipped_calibration()
    assert table.solver in table.reference
    assert table.machine["processor"]


def test_what_is_no_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(DataError, match=r"srbval bench --ladder -o table\.json"):
        load_calibration(path)
