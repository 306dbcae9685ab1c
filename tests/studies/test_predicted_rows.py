"""Blind rows: only of records that nobody had opened, and only of predictions that are as they were hashed."""

from pathlib import Path
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.recordings.registry import RegisteredRecording, add, rig_recordings
from srbval.studies.predicted_rows import digest, rows_of_predictions
from tests.comparison.test_matrix import BEARING, rig_file

PREDICTION: dict[str, Any] = {
    "state": "inner", "nominal_rpm": 607.0, "radial_kn": 124.8, "axial_kn": 0.0, "shaft_rpm": 591.2,
    "values": {"cage ratio": 0.4312, "1000 Hz": -20.0, "harmonic 2": -3.0},
    "parts": {"inputs": {"cage ratio": 0.0004, "1000 Hz": 3.0, "harmonic 2": 2.0}},
}  # fmt: skip


def content(**changes: Any) -> dict[str, Any]:
    return {"predictions": [PREDICTION], "predictions_sha256": digest([PREDICTION])} | changes


@pytest.fixture
def registered(tmp_path: Path) -> tuple[RegisteredRecording, ...]:
    for code, rpm, shaft_rpm in (("IR", 607, 591.0), ("H", 607, 591.0), ("IR", 877, 855.0), ("OR", 607, 591.0)):
        rig_file(tmp_path, code, rpm, shaft_rpm)
    add(tmp_path)
    return rig_recordings()


def test_rows_are_blind_and_those_of_changed_predictions_are_not(registered: tuple[RegisteredRecording, ...]) -> None:
    rows = rows_of_predictions(content(), registered, BEARING)
    assert {row.quantity for row in rows} == set(PREDICTION["values"])
    assert {(row.state, row.used_for) for row in rows} == {(Fault.INNER, "blind")}
    cage = next(row for row in rows if row.quantity == "cage ratio")
    assert cage.rig.value == pytest.approx(BEARING.orders.ftf, abs=1.5 * (cage.rig.ci95 or 0.0))
    assert cage.error == pytest.approx(100 * (0.4312 / cage.rig.value - 1))
    assert cage.parts["inputs"] == pytest.approx(100 * 0.0004 / cage.rig.value)
    changed = content(predictions=[PREDICTION | {"shaft_rpm": 591.3}])
    assert {row.used_for for row in rows_of_predictions(changed, registered, BEARING)} == {"withheld"}


def test_an_opened_record_is_not_blind_and_one_that_is_not_there_or_unreadable_has_no_rows(
    registered: tuple[RegisteredRecording, ...],
) -> None:
    opened = PREDICTION | {"nominal_rpm": 877.0}
    rows = rows_of_predictions({"predictions": [opened], "predictions_sha256": digest([opened])}, registered, BEARING)
    assert {row.used_for for row in rows} == {"withheld"}
    assert rows_of_predictions(None, registered, BEARING) == ()
    assert rows_of_predictions(content(predictions=[PREDICTION | {"state": "roller"}]), registered, BEARING) == ()
    for entry in registered:
        Path(entry.file).write_bytes(b"not a record any more")
    assert rows_of_predictions(content(), registered, BEARING) == ()
