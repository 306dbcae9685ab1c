"""The validation matrix and the check on other rigs: what is there is judged, what is not stays empty."""

from __future__ import annotations

import dataclasses
import math
from concurrent.futures import Executor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, load_bearing
from srbval.comparison.bias import biases, pairs
from srbval.comparison.compared_quantities import (
    CAGE_RATIO,
    HARMONIC,
    KINDS,
    PRESENCE,
    ROLLER_LINE,
    SHAPE,
    values_of_model,
)
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.effects import NO_SENSITIVITY, DefectEffects, QuantityEffects, Sensitivity
from srbval.comparison.matrix import BASELINE, NOT_DETECTED, Matrix, build_matrix
from srbval.comparison.other_rigs import read_other_rigs
from srbval.diagnosis.baseline_comparison import Basis
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import RACE_LINES
from srbval.recordings import Origin, SpeedSource
from srbval.recordings.datasets.description import dataset
from srbval.recordings.registry import add, rig_recordings
from srbval.recordings.synthetic_record import vibration
from srbval.report.blocks import Figure, FigureGrid, Paragraph
from srbval.report.findings.stored import ShownResult
from srbval.report.sections.matrix import matrix_section
from srbval.report.sections.other_rigs import other_rigs_section
from tests.recordings import files

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


NO_RATES = {"record_verdicts": SimpleNamespace(content=None)}
KNOWN = Sensitivity(defects=(known("outer", "BPFO"), known("inner", "BPFI")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    for code in CODES:
        rig_file(folder, code)
    savemat(folder / "105_IR007_0_12kDE.mat", {"X105_DE_time": files.vibration(36000)[:, None], "X105RPM": 1797})
    return folder


def made(folder: Path, counterpart: Any = another_impulse_model, **options: Any) -> Matrix:
    add(folder)
    return build_matrix(
        rig_recordings(), bearing=BEARING, counterpart=counterpart, sensitivity=KNOWN, jobs=1, **options
    )


def test_cells_hold_what_was_measured_and_the_rest_is_empty(folder: Path) -> None:
    matrix = made(folder)
    assert matrix.size == 160
    assert {(c.state, c.nominal_rpm, c.radial_kn) for c in matrix.cells} == {(s, 877.0, 124.8) for s in CODES.values()}
    assert matrix.at((Fault.OUTER, 124.8, 0.0, 353.0)) is None
    outer = matrix.at((Fault.OUTER, 124.8, 0.0, 877.0))
    assert outer is not None
    assert outer.line.detected
    assert outer.speed.source is SpeedSource.TACHOMETER
    assert outer.model_hz == pytest.approx(19 * CAGE * outer.shaft_rpm / 60)
    assert outer.error_pct == pytest.approx(100 * (outer.model_hz / outer.line.found_hz - 1))
    inner = matrix.at((Fault.INNER, 124.8, 0.0, 877.0))
    assert inner is not None
    read = 1 - inner.line.found_hz / 19 / inner.speed.value_hz
    assert inner.error_pct == pytest.approx(100 * (CAGE / read - 1))  # not of the line, whose sign is the other
    assert outer.uncertainty_pct is not None
    assert outer.uncertainty_pct > 0.09  # the known term's
    assert abs(outer.line.deviation_pct or 9) < 0.3


def test_a_registered_record_is_a_comparison_of_every_quantity(folder: Path, tmp_path: Path) -> None:
    """Nothing but files that are registered: each adds its cell, and its pairs to every kind of quantity."""
    before = made(folder)
    for code in ("H", "IR", "OR"):
        rig_file(tmp_path, code, rpm=727, shaft_rpm=709.0)
    after = made(tmp_path)
    new = [c for c in after.cells if c not in before.cells and c.nominal_rpm == 727.0]
    assert {c.state for c in new} == set(CODES.values())
    kinds = {c.state: {row.kind for row in c.comparisons} for c in new}
    of_races = {kind.name for kind in KINDS} - {ROLLER_LINE.name}
    assert kinds[Fault.INNER] <= of_races
    assert kinds[Fault.INNER] >= {CAGE_RATIO.name, HARMONIC[2].name, PRESENCE.name, SHAPE.name}
    assert kinds[Fault.OUTER] >= {CAGE_RATIO.name, HARMONIC[2].name, SHAPE.name}
    assert kinds[Fault.OUTER] <= {CAGE_RATIO.name, SHAPE.name, *(kind.name for kind in HARMONIC.values())}
    assert kinds[Fault.HEALTHY] == set()
    counted = [{b.kind: b.records for b in biases(pairs(m.cells))} for m in (before, after)]
    assert set(counted[1]) <= of_races - {PRESENCE.name}
    for kind in (CAGE_RATIO, HARMONIC[2], SHAPE):  # higher harmonics need not show on both sides
        assert (counted[0][kind.name], counted[1][kind.name]) == (2, 4)
    assert all(row.bias is None for row in biases(pairs(after.cells)))  # four records claim nothing


def test_bias_is_the_planted_one_and_like_spectra_are_told_as_like(folder: Path) -> None:
    """Both sides are the same impulse model but for the cage: that is the bias, and no shape or pattern stands out."""
    cells = made(folder).cells
    frequency = {c.state: c.error_pct for c in cells if c.comparisons}
    kinematic = BEARING.orders
    assert frequency[Fault.OUTER] == pytest.approx(100 * (19 * CAGE / kinematic.bpfo - 1), abs=LINE_PCT)
    assert frequency[Fault.INNER] == pytest.approx(100 * (19 * CAGE / kinematic.bpfo - 1), abs=LINE_PCT)
    shapes = [row for c in cells for row in c.comparisons if row.kind == SHAPE.name]
    assert len(shapes) == 2
    assert all(abs(row.error) < math.hypot(*row.parts.values()) for row in shapes)
    judged = {c.state: c.judged for c in cells if c.judged is not None}
    assert set(judged) == {Fault.OUTER, Fault.INNER}
    # The planted 0.3 % of the cage ratio is far beyond what is not known; all that is compared is judged at once.
    assert all(one.p_holm < 0.05 and {"cage ratio"} < set(one.quantities) for one in judged.values())
    assert {c.verdict for c in cells if c.judged} == {"resolved"}
    shown = [row for c in cells for row in c.comparisons if row.kind == PRESENCE.name]
    assert [(row.model.value, row.rig.value) for row in shown] == [(1.0, 1.0)]


def test_healthy_cells_are_baselines_and_cost_no_run(folder: Path) -> None:
    asked = []

    def counterpart(rig: Analysis, pool: Executor) -> AnalysedRun:
        asked.append(rig.recording.state)
        return another_impulse_model(rig, pool)

    healthy = made(folder, counterpart).at((Fault.HEALTHY, 124.8, 0.0, 877.0))
    assert healthy is not None
    assert (healthy.verdict in (BASELINE, NOT_DETECTED), healthy.model_hz) == (True, None)
    assert Fault.HEALTHY not in asked
    sides = made(folder, counterpart, keep_sides_of={(Fault.HEALTHY, 124.8, 0.0, 877.0)}).sides
    assert Fault.HEALTHY in asked
    assert {point[0] for point in sides} == {Fault.HEALTHY}


def test_faults_are_called_against_the_healthy_cell(folder: Path) -> None:
    calls = {c.state: c.call for c in made(folder).cells}
    assert (calls[Fault.OUTER].basis, calls[Fault.OUTER].called) == (Basis.BASELINE, Fault.OUTER)
    assert calls[Fault.INNER].called is Fault.INNER
    assert calls[Fault.HEALTHY].called is None


def test_without_a_healthy_record_a_line_alone_cannot_tell(tmp_path: Path) -> None:
    rig_file(tmp_path, "OR")
    (cell,) = made(tmp_path).cells
    assert (cell.call.basis, cell.call.called) == (Basis.LINE_ALONE, None)


def test_failed_model_run_leaves_the_models_side_empty(folder: Path) -> None:
    matrix = made(folder, lambda *_: "the load was lost")
    faults = [c for c in matrix.cells if c.state is not Fault.HEALTHY]
    assert all(c.model_hz is None and c.error_pct is None and c.remark == "the load was lost" for c in faults)
    assert {c.verdict for c in faults} <= {"insufficient data", NOT_DETECTED}


def test_damaged_healthy_record_is_listed_and_is_no_baseline(tmp_path: Path) -> None:
    for code in ("H", "OR"):
        rig_file(tmp_path, code)
    add(tmp_path)
    (tmp_path / "H_877rpm_made.mat").write_bytes(b"not a record any more")
    matrix = build_matrix(
        rig_recordings(), bearing=BEARING, counterpart=another_impulse_model, sensitivity=NO_SENSITIVITY, jobs=2
    )  # fmt: skip
    assert [c.state for c in matrix.cells] == [Fault.OUTER]
    assert matrix.cells[0].call.basis is Basis.LINE_ALONE


def evidence_of(matrix: Matrix) -> Any:
    found = pairs(matrix.cells)
    return SimpleNamespace(matrix=matrix, pairs=found, bias=biases(found), known=KNOWN, results=NO_RATES)


def test_maps_leave_empty_cells_empty(folder: Path, tmp_path: Path) -> None:
    section = matrix_section(evidence_of(made(folder)))
    drawn, bias = (
        ["Paragraph", "FigureGrid", "Table", "Paragraph"],
        ["Table", "Paragraph", "Table", "Paragraph", "Table", "Table", "FigureGrid"],
    )
    assert [b.__class__.__name__ for b in section.appendix] == drawn + bias
    (grid,) = (block for block in section.appendix[:2] if isinstance(block, FigureGrid))
    assert [figure.id for figure in grid.figures] == ["matrix-deviation", "matrix-detectability", "matrix-verdict"]
    for figure in grid.figures:
        files = figure.draw(tmp_path, figure.id)
        lines = files.data.read_text().splitlines()
        cells = [value for line in lines[1:] for value in line.split(",")[1:]]
        assert len(cells) == 160
        assert 1 <= sum(value != "" for value in cells) <= 3
        assert files.picture.stat().st_size > 5000


def test_empty_matrix_says_so() -> None:
    matrix = build_matrix((), bearing=BEARING, counterpart=another_impulse_model, sensitivity=NO_SENSITIVITY)
    section = matrix_section(evidence_of(matrix))
    assert "all 160 cells are empty" in section.appendix[-1].text  # type: ignore[union-attr]
    assert not any(isinstance(block, Figure | FigureGrid) for block in section.all_blocks)


def test_other_rigs_are_read_apart_from_the_rig(folder: Path) -> None:
    (record,) = read_other_rigs(add(folder).recordings)
    assert (record.dataset, record.state, record.line.name, record.diagnosable) == ("cwru", Fault.INNER, "BPFI", True)
    assert (record.line.detected, record.shown) == (False, False)  # the made file holds noise
    naming = ShownResult(kind="diagnosis", command="srbval bench --diagnosis", content=None, origin=None)
    evidence = SimpleNamespace(other_rigs=(record,), datasets={"cwru": dataset("cwru")}, results={"diagnosis": naming})
    (section,) = other_rigs_section(evidence)  # type: ignore[arg-type]
    assert "0 of 1 race faults graded diagnosable (not " in section.appendix[2].text  # type: ignore[union-attr]
    said = " ".join(b.text for b in section.appendix if isinstance(b, Paragraph))
    assert "1 race-fault records have none: there a line alone cannot tell" in said
    assert other_rigs_section(SimpleNamespace(other_rigs=())) == ()  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.recordings
def test_open_recordings_show_their_faults(recordings_dir: Path) -> None:
    """Race faults by their published grade, in a band chosen on no record; healthy ones show none; near kinematics."""
    registered = [r for name in ("cwru", "mfpt", "hit_sm") for r in add(recordings_dir / name).recordings]
    records = [r for r in read_other_rigs(registered) if not r.refused]
    races = [r for r in records if r.line.name in RACE_LINES and r.state not in (None, Fault.HEALTHY)]
    assert len(races) >= 30
    plain = [r for r in races if (r.plain_grade or "").startswith("Y")]
    assert len(plain) >= 8
    assert all(r.shown for r in plain)
    graded = [r for r in races if r.diagnosable]  # by any method of the study: 197 by a kurtogram only
    assert sum(not r.shown for r in graded) <= 1
    held = [r for r in races if r.diagnosable is not False and not (r.plain_grade or "").startswith("N")]
    assert sum(r.shown for r in held) >= 0.95 * len(held)
    assert not [r.file for r in records if r.state is Fault.HEALTHY and (r.shown or r.call is None or r.call.indicated)]
    near = [
        abs(r.line.deviation_pct or 9) <= 0.5 for r in held if r.shown and r.speed.source is not SpeedSource.NOMINAL
    ]
    assert sum(near) >= 0.95 * len(near)


@pytest.mark.slow
@pytest.mark.recordings
def test_light_load_lets_the_cage_slip(recordings_dir: Path) -> None:
    """MFPT: inner and outer records agree on a cage that lags, least at the highest load."""
    records = [r for r in read_other_rigs(add(recordings_dir / "mfpt").recordings) if r.cage_pct is not None]
    loads = {
        race: sorted((r.radial_n, r.cage_pct) for r in records if r.line.name == race) for race in ("BPFO", "BPFI")
    }
    for race in loads.values():
        assert all(cage < 0 for _, cage in race)
        assert race[0][1] == min(cage for _, cage in race)
        assert race[-1][1] == max(cage for _, cage in race)
