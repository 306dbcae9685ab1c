"""The validation matrix: what is there is judged, what is not stays empty."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC, PRESENCE, values_of_model
from srbval.comparison.counterpart import AnalysedRun
from srbval.errors import NumericsError
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Origin, SpeedSource
from srbval.recordings.registry import add
from srbval.report.findings import matrix as matrix_module
from srbval.report.findings.matrix import BASELINE, NOT_DETECTED, Matrix, MatrixRows
from srbval.validation import sides, validate
from srbval.validation.pairing import OperatingPoint
from tests.recordings import files
from tests.recordings.synthetic_record import vibration

LINE_PCT = 0.06  # the interval of a line read from two seconds of the impulse model

BEARING = load_bearing("skf-22240")
FS_HZ, SECONDS, RPM = 20480.0, 2.0, 858.0
CAGE = 0.432
CODES = {"H": Fault.HEALTHY, "OR": Fault.OUTER, "IR": Fault.INNER}


def rig_file(folder: Path, code: str, rpm: float = 877, shaft_rpm: float = RPM) -> None:
    """A file in the excerpts' layout, its signal made by the impulse model for this test."""
    count = int(FS_HZ * SECONDS)
    turns = np.arange(count) * shaft_rpm / 60 / FS_HZ
    signal = vibration(CODES[code], BEARING.orders, turns, np.random.default_rng(len(code)))
    changes = {"acc_m_s2": signal, "time_acc": np.arange(count) / FS_HZ, "condition": code, "rpm_nominal": rpm}
    changes["rpm"] = np.full(count, shaft_rpm)
    files.excerpt(folder / f"{code}_{rpm:g}rpm_made.mat", **changes)


def another_impulse_model(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
    """A stand-in for the model's run: the impulse model once more, other noise, the cage a little too fast."""
    recording = rig.recording
    state = recording.state or Fault.HEALTHY
    turns = np.arange(int(FS_HZ * SECONDS)) * rig.speed.value_hz / FS_HZ
    orders = dataclasses.replace(BEARING.orders, bpfo=19 * CAGE, bpfi=19 * (1 - CAGE))
    made = dataclasses.replace(
        recording,
        origin=Origin.SIMULATED,
        band_hz=recording.band_hz,
        channels={"x": vibration(state, orders, turns, np.random.default_rng(99))},
        channel="x",
    )
    order = {Fault.OUTER: 19 * CAGE, Fault.INNER: 19 * (1 - CAGE)}.get(state)
    analysis = analyse(made, bearing=BEARING, speed=rig.speed)
    values = values_of_model(analysis, state, order, sides.QUANTITIES)
    run = SimpleNamespace(cage_ratio=CAGE)
    return AnalysedRun(case=None, run=run, analysis=analysis, line_order=order, values=values)  # type: ignore[arg-type]


def known(defect: str, line: str) -> dict[tuple[str, str], dict[str, float]]:
    sizes = {"cage ratio": 0.0004, f"2x{line}": 1.0, f"{line} sidebands": 1.0}
    return {(defect, name): {"shift": 0.0, "inputs_ci95": size, "grid_ci95": 0.0} for name, size in sizes.items()}


KNOWN = known("outer", "BPFO") | known("inner", "BPFI")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    for code in CODES:
        rig_file(folder, code)
    return folder


def made(folder: Path, *of: Any, **options: Any) -> Matrix:
    add(folder)
    return of_registered(*of, **options)


def of_registered(
    counterpart: Any = another_impulse_model, effects: Any = KNOWN, keep: Any = (), jobs: int = 2
) -> Matrix:
    rows = MatrixRows(keep)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(validate, "effects_of", lambda _: effects)
        for module in (sides, matrix_module):
            patch.setattr(module, "run_counterpart", counterpart)
        result = validate.validate("torino-22240", found=rows.add, jobs=jobs)
    return rows.matrix((f"pair {one['pair']}", one["reason"]) for one in result.failed)


@pytest.fixture(scope="module")
def matrix(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Matrix:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        patch.delenv("SRBVAL_RECORDINGS", raising=False)
        return made(folder)


def cell_of(matrix: Matrix, state: Fault) -> Any:
    return matrix.records.set_index("state").loc[state.value]


def kinds_of(matrix: Matrix, state: Fault, rpm: float) -> set[str]:
    records = matrix.records
    files = records[(records["nominal_rpm"] == rpm) & (records["state"] == state.value)]["file"]
    return set(matrix.comparisons[matrix.comparisons["record"].isin(files)]["kind"])


def test_records_hold_what_was_measured_and_the_rest_is_empty(matrix: Matrix) -> None:
    points = matrix.records[["state", "radial_kn", "axial_kn", "nominal_rpm"]]
    assert set(points.itertuples(index=False, name=None)) == {(s.value, 124.8, 0.0, 877.0) for s in CODES.values()}
    outer, inner = (cell_of(matrix, state) for state in (Fault.OUTER, Fault.INNER))
    assert outer["detected"]
    assert outer["speed_source"] == SpeedSource.TACHOMETER.value
    assert outer["model_hz"] == pytest.approx(19 * CAGE * outer["shaft_rpm"] / 60)
    assert outer["error_pct"] == pytest.approx(100 * (outer["model_hz"] / outer["found_hz"] - 1))
    read = 1 - inner["found_hz"] / 19 / (inner["shaft_rpm"] / 60)
    assert inner["error_pct"] == pytest.approx(100 * (CAGE / read - 1))  # not of the line, whose sign is the other
    assert outer["uncertainty_pct"] > 0.09  # the known term's
    assert abs(outer["deviation_pct"]) < 0.3


def test_a_registered_record_is_a_comparison_of_every_quantity(matrix: Matrix, folder: Path, tmp_path: Path) -> None:
    """Nothing but files that are registered: each adds its record, and its rows to every kind of quantity."""
    add(folder)
    for code in ("H", "IR", "OR"):
        rig_file(tmp_path, code, rpm=727, shaft_rpm=709.0)
    after = made(tmp_path)
    levels = {row.kind for row in HARMONIC.values()}
    assert {CAGE_RATIO.kind, HARMONIC[2].kind, PRESENCE.kind} <= kinds_of(after, Fault.INNER, 727.0)
    assert {CAGE_RATIO.kind, HARMONIC[2].kind} <= kinds_of(after, Fault.OUTER, 727.0) <= {CAGE_RATIO.kind, *levels}
    assert kinds_of(after, Fault.HEALTHY, 727.0) == set()
    counted = [{b["kind"]: b["records"] for b in biases(m.comparisons, used_for="withheld")} for m in (matrix, after)]
    for row in (CAGE_RATIO, HARMONIC[2]):  # higher harmonics need not show on both sides
        assert (counted[0][row.kind], counted[1][row.kind]) == (2, 4)


def test_bias_is_the_planted_one(matrix: Matrix) -> None:
    """Both sides are the same impulse model but for the cage: that is the bias, and sidebands show on both."""
    planted = 100 * (19 * CAGE / BEARING.orders.bpfo - 1)
    for state in (Fault.OUTER, Fault.INNER):
        cell = cell_of(matrix, state)
        assert cell["error_pct"] == pytest.approx(planted, abs=LINE_PCT)
        assert cell["verdict"] == "differs"  # the planted 0.3 % of the cage ratio is far beyond what is not known
    shown = matrix.comparisons[matrix.comparisons["kind"] == PRESENCE.kind]
    assert shown[["model", "rig"]].to_numpy().tolist() == [[1.0, 1.0]]


def test_healthy_cells_are_baselines_and_cost_no_run(matrix: Matrix, folder: Path) -> None:
    healthy = cell_of(matrix, Fault.HEALTHY)
    assert healthy["verdict"] in (BASELINE, NOT_DETECTED)
    assert pd.isna(healthy["model_hz"])
    asked = []

    def counterpart(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
        asked.append(rig.recording.state)
        raise NumericsError("the load was lost")

    point = OperatingPoint(Fault.HEALTHY, 124.8, 0.0, 877.0)
    failed = made(folder, counterpart, keep={point})
    assert sorted(asked) == sorted(CODES.values())  # the healthy record's run was asked for
    assert list(failed.sides) == [point]
    faults = failed.records[failed.records["state"] != Fault.HEALTHY.value]
    assert faults[["model_hz", "error_pct"]].isna().all(axis=None)
    assert set(faults["remark"]) == {"the load was lost"}
    assert set(faults["verdict"]) <= {"insufficient data", NOT_DETECTED}
    asked.clear()
    made(folder, counterpart)
    assert Fault.HEALTHY not in asked


def test_without_a_healthy_record_a_line_alone_does_not_name_a_fault(tmp_path: Path) -> None:
    for code in ("H", "OR"):
        rig_file(tmp_path, code)
    add(tmp_path)
    (tmp_path / "H_877rpm_made.mat").write_bytes(b"not a record any more")
    found = of_registered(effects={}, jobs=1)
    (call,) = found.records["call"]
    assert (call.baseline, call.risen) == (None, None)
