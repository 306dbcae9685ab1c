"""The validation matrix: what is there is judged, what is not stays empty."""

import dataclasses
import math
from concurrent.futures import Executor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC, PRESENCE, SHAPE, values_of_model
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.effects import DefectEffects, QuantityEffects, Sensitivity
from srbval.comparison.matrix import BASELINE, NOT_DETECTED, Matrix, MatrixCell, build_matrix
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Origin, SpeedSource
from srbval.recordings.registry import add, rig_recordings
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


def another_impulse_model(rig: Analysis, _: Executor) -> AnalysedRun:
    """A stand-in for the model's run: the impulse model once more, other noise, the cage a little too fast."""
    recording = rig.recording
    state = recording.state or Fault.HEALTHY
    turns = np.arange(int(FS_HZ * SECONDS)) * rig.speed.value_hz / FS_HZ
    orders = dataclasses.replace(BEARING.orders, bpfo=19 * CAGE, bpfi=19 * (1 - CAGE))
    made = dataclasses.replace(
        recording, origin=Origin.SIMULATED, band_hz=recording.band_hz,
        channels={"x": vibration(state, orders, turns, np.random.default_rng(99))}, channel="x",
    )  # fmt: skip
    order = {Fault.OUTER: 19 * CAGE, Fault.INNER: 19 * (1 - CAGE)}.get(state)
    analysis = analyse(made, bearing=BEARING, speed=rig.speed)
    case = SimpleNamespace(base="paper")
    values = values_of_model(analysis, state, order)
    return AnalysedRun(case=case, run=None, analysis=analysis, line_order=order, values=values)  # type: ignore[arg-type]


def known(defect: str, line: str) -> DefectEffects:
    sizes = {"cage ratio": ("1", 0.0002), f"2x{line}": ("dB", 0.5), f"{line} sidebands": ("dB", 0.5)}
    return DefectEffects(
        defect=defect, draws=100, failed=0, refined=False,
        predicted=(1 + np.random.default_rng(8).standard_normal((100, 3)) * [s for _, s in sizes.values()]).tolist(),
        quantities=tuple(
            QuantityEffects(
                name=name, unit=unit, value=1.0, shift=0.0, deviation=size, shares={"load": 0.6, "friction": 0.1},
                grid_ci95=0.0, paper_points=-1.0, paper_points_ci95=0.3, start_sd=0.0, paper_start_sd=0.1, outside=0.0,
            )
            for name, (unit, size) in sizes.items()
        ),
    )  # fmt: skip


KNOWN = Sensitivity(defects=(known("outer", "BPFO"), known("inner", "BPFI")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    for code in CODES:
        rig_file(folder, code)
    return folder


def made(folder: Path, counterpart: Any = another_impulse_model, **options: Any) -> Matrix:
    add(folder)
    settings = {"sensitivity": KNOWN, "jobs": 2} | options
    return build_matrix(rig_recordings(), bearing=BEARING, counterpart=counterpart, **settings)


@pytest.fixture(scope="module")
def matrix(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Matrix:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        patch.delenv("SRBVAL_RECORDINGS", raising=False)
        return made(folder)


def cell_of(matrix: Matrix, state: Fault) -> MatrixCell:
    return next(cell for cell in matrix.cells if cell.state is state)


def test_cells_hold_what_was_measured_and_the_rest_is_empty(matrix: Matrix) -> None:
    assert matrix.size == 160
    assert {c.point for c in matrix.cells} == {(s, 124.8, 0.0, 877.0) for s in CODES.values()}
    outer, inner = (cell_of(matrix, state) for state in (Fault.OUTER, Fault.INNER))
    assert outer.line.detected
    assert outer.speed.source is SpeedSource.TACHOMETER
    assert outer.model_hz == pytest.approx(19 * CAGE * outer.shaft_rpm / 60)
    assert outer.error_pct == pytest.approx(100 * (outer.model_hz / outer.line.found_hz - 1))
    read = 1 - inner.line.found_hz / 19 / inner.speed.value_hz
    assert inner.error_pct == pytest.approx(100 * (CAGE / read - 1))  # not of the line, whose sign is the other
    assert outer.uncertainty_pct > 0.09  # the known term's
    assert abs(outer.line.deviation_pct or 9) < 0.3


def test_a_registered_record_is_a_comparison_of_every_quantity(matrix: Matrix, folder: Path, tmp_path: Path) -> None:
    """Nothing but files that are registered: each adds its cell, and its rows to every kind of quantity."""
    add(folder)
    for code in ("H", "IR", "OR"):
        rig_file(tmp_path, code, rpm=727, shaft_rpm=709.0)
    after = made(tmp_path)
    kinds = {c.state: {row.kind for row in c.comparisons} for c in after.cells if c.nominal_rpm == 727.0}
    levels = {row.kind for row in HARMONIC.values()}
    assert {CAGE_RATIO.kind, HARMONIC[2].kind, PRESENCE.kind, SHAPE.kind} <= kinds[Fault.INNER]
    assert {CAGE_RATIO.kind, HARMONIC[2].kind, SHAPE.kind} <= kinds[Fault.OUTER] <= {
        CAGE_RATIO.kind, SHAPE.kind, *levels,
    }  # fmt: skip
    assert kinds[Fault.HEALTHY] == set()
    counted = [{b["kind"]: b["records"] for b in biases(m.comparisons, used_for="withheld")} for m in (matrix, after)]
    for row in (CAGE_RATIO, HARMONIC[2], SHAPE):  # higher harmonics need not show on both sides
        assert (counted[0][row.kind], counted[1][row.kind]) == (2, 4)


def test_bias_is_the_planted_one_and_like_spectra_are_told_as_like(matrix: Matrix) -> None:
    """Both sides are the same impulse model but for the cage: that is the bias, and no shape or pattern stands out."""
    planted = 100 * (19 * CAGE / BEARING.orders.bpfo - 1)
    for state in (Fault.OUTER, Fault.INNER):
        cell = cell_of(matrix, state)
        assert cell.error_pct == pytest.approx(planted, abs=LINE_PCT)
        assert cell.verdict == "resolved"  # the planted 0.3 % of the cage ratio is far beyond what is not known
    shapes = [row for row in matrix.comparisons if row.kind == SHAPE.kind]
    assert len(shapes) == 2
    assert all(abs(row.error) < math.hypot(*row.parts.values()) for row in shapes)
    shown = [row for row in matrix.comparisons if row.kind == PRESENCE.kind]
    assert [(row.model.value, row.rig.value) for row in shown] == [(1.0, 1.0)]


def test_healthy_cells_are_baselines_and_cost_no_run(matrix: Matrix, folder: Path) -> None:
    healthy = cell_of(matrix, Fault.HEALTHY)
    assert (healthy.verdict in (BASELINE, NOT_DETECTED), healthy.model_hz) == (True, None)
    asked = []

    def counterpart(rig: Analysis, _: Executor) -> str:
        asked.append(rig.recording.state)
        return "the load was lost"

    point = (Fault.HEALTHY, 124.8, 0.0, 877.0)
    failed = made(folder, counterpart, keep_sides_of={point})
    assert sorted(asked) == sorted(CODES.values())  # the healthy record's run was asked for
    assert list(failed.sides) == [point]
    faults = [cell for cell in failed.cells if cell.state is not Fault.HEALTHY]
    assert all(c.model_hz is None and c.error_pct is None and c.remark == "the load was lost" for c in faults)
    assert {c.verdict for c in faults} <= {"insufficient data", NOT_DETECTED}
    asked.clear()
    made(folder, counterpart)
    assert Fault.HEALTHY not in asked


def test_faults_are_called_against_the_healthy_cell(matrix: Matrix) -> None:
    calls = {c.state: c.call for c in matrix.cells}
    assert calls[Fault.OUTER].risen is Fault.OUTER
    assert calls[Fault.INNER].risen is Fault.INNER
    assert calls[Fault.HEALTHY].risen is None


@pytest.mark.parametrize("damaged", [False, True])
def test_without_a_healthy_record_a_line_alone_cannot_tell(damaged: bool, tmp_path: Path) -> None:
    for code in ("H", "OR") if damaged else ("OR",):
        rig_file(tmp_path, code)
    add(tmp_path)
    if damaged:
        (tmp_path / "H_877rpm_made.mat").write_bytes(b"not a record any more")
    found = build_matrix(
        rig_recordings(), bearing=BEARING, counterpart=another_impulse_model, sensitivity=Sensitivity(), jobs=1
    )
    (cell,) = found.cells
    assert (cell.call.baseline, cell.call.risen) == (None, None)
