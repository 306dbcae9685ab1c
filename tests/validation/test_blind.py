"""Blind rows: only of records that nobody had opened, and only of predictions that are as they were hashed."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.evidence.stored import ShownResult
from srbval.recordings.registry import RegisteredRecording, add, rig_recordings, unopened
from srbval.report.blocks import Paragraph
from srbval.report.content.rig_scene import rig_scene_section
from srbval.report.table import Table
from srbval.storage.stored_result import AMPLITUDES, BLIND, RIG_BANDS, RIG_INPUTS, WATERFALL
from srbval.validation.blind import blind_rows, digest
from tests.validation.test_matrix import BEARING, rig_file

PREDICTION: dict[str, Any] = {
    "state": "inner", "nominal_rpm": 353.0, "radial_kn": 124.8, "axial_kn": 0.0, "shaft_rpm": 335.77,
    "values": {"cage ratio": 0.4312, "1000 Hz": -20.0, "harmonic 2": -3.0},
    "parts": {"inputs": {"cage ratio": 0.0004, "1000 Hz": 3.0, "harmonic 2": 2.0}},
}  # fmt: skip


ORIGIN = dict.fromkeys(("made_utc", "git_revision", "command", "processor", "usable_cores", "file"), "x")


def content(**changes: Any) -> dict[str, Any]:
    return {"predictions": [PREDICTION], "predictions_sha256": digest([PREDICTION])} | changes


@pytest.fixture
def registered(tmp_path: Path) -> tuple[RegisteredRecording, ...]:
    for code, rpm, shaft_rpm in (("IR", 353, 336.0), ("H", 353, 336.0), ("IR", 877, 855.0), ("OR", 353, 336.0)):
        rig_file(tmp_path, code, rpm, shaft_rpm)
    add(tmp_path)
    return rig_recordings()


def test_a_record_at_an_opened_operating_point_is_not_unopened(registered: tuple[RegisteredRecording, ...]) -> None:
    found = {(one.state, one.nominal_rpm): unopened(one) for one in registered}
    assert found == {
        (Fault.INNER, 353.0): True, (Fault.OUTER, 353.0): True, (Fault.INNER, 877.0): False,
        (Fault.HEALTHY, 353.0): False,
    }  # fmt: skip


def test_rows_are_blind_and_those_of_changed_predictions_are_not(registered: tuple[RegisteredRecording, ...]) -> None:
    rows = blind_rows(content(), registered, BEARING)
    assert {row.quantity for row in rows} == set(PREDICTION["values"])
    assert {(row.fault, row.used_for) for row in rows} == {(Fault.INNER, "blind")}
    cage = next(row for row in rows if row.quantity == "cage ratio")
    assert cage.rig.value == pytest.approx(BEARING.orders.ftf, abs=1.5 * (cage.rig.ci95 or 0.0))
    assert cage.error == pytest.approx(100 * (0.4312 / cage.rig.value - 1))
    assert cage.parts["inputs"] == pytest.approx(100 * 0.0004 / cage.rig.value)
    changed = content(predictions=[PREDICTION | {"shaft_rpm": 335.78}])
    assert {row.used_for for row in blind_rows(changed, registered, BEARING)} == {"withheld"}


def test_without_the_record_or_a_prediction_there_are_no_rows(registered: tuple[RegisteredRecording, ...]) -> None:
    assert blind_rows(None, registered, BEARING) == ()
    assert blind_rows(content(predictions=[PREDICTION | {"state": "roller"}]), registered, BEARING) == ()
    opened = content(predictions=[PREDICTION | {"nominal_rpm": 877.0}])
    assert blind_rows(opened, registered, BEARING) == ()


@pytest.mark.parametrize("known", [False, True])
def test_the_report_states_hash_and_outcome(known: bool, registered: tuple[RegisteredRecording, ...]) -> None:
    stored = {BLIND: content() | {"made_utc": datetime.now(UTC).isoformat()}}
    results = {
        kind: ShownResult(kind=kind, command="c", content=stored.get(kind), origin=ORIGIN)
        for kind in (RIG_INPUTS, RIG_BANDS, AMPLITUDES, WATERFALL, BLIND)
    }
    rows = blind_rows(content(), registered, BEARING) if known else ()
    section = rig_scene_section(SimpleNamespace(results=results, blind=rows))  # type: ignore[arg-type]
    (said,) = [block.text for block in section.blocks if isinstance(block, Paragraph) and "Blind" in block.text]
    assert digest([PREDICTION]) in said
    assert ("is off by" in said) is known
    assert ("None of them is registered" in said) is not known
    tables = [block.id for block in section.appendix if isinstance(block, Table)]
    assert tables == ["blind-predictions", *["blind-rows"] * known]
