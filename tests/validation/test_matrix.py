"""The validation matrix and the check on other rigs: what is there is judged, what is not stays empty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import load_bearing
from srbval.recordings import State
from srbval.recordings.registry import add, rig_recordings
from srbval.recordings.stand_in import vibration
from srbval.report.blocks import Paragraph
from srbval.report.content.matrix_section import matrix_section
from srbval.report.content.other_rigs_section import other_rigs_section
from srbval.validation.analyse import Analysis
from srbval.validation.fault_call import Basis
from srbval.validation.matrix import NOT_DETECTED, Matrix, build_matrix
from srbval.validation.other_rigs import read_other_rigs
from tests.recordings import files

BEARING = load_bearing("skf-22240")
FS_HZ, SECONDS, RPM = 20480.0, 2.0, 858.0
CAGE = 0.4305
CODES = {"H": State.HEALTHY, "OR": State.OUTER, "IR": State.INNER}


def rig_file(folder: Path, code: str, rpm: float = 877) -> None:
    """A file in the excerpts' layout, its signal made by the impulse model for this test."""
    count = int(FS_HZ * SECONDS)
    turns = np.arange(count) * RPM / 60 / FS_HZ
    signal = vibration(CODES[code], BEARING.orders, turns, np.random.default_rng(len(code)))
    changes = {"acc_m_s2": signal, "time_acc": np.arange(count) / FS_HZ, "condition": code, "rpm_nominal": rpm}
    files.excerpt(folder / f"{code}_{rpm:g}rpm_made.mat", **changes)


def with_cage(analyses: Sequence[Analysis]) -> list[Any]:
    return [SimpleNamespace(cage_ratio=CAGE) for _ in analyses]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    for code in CODES:
        rig_file(folder, code)
    savemat(folder / "105_IR007_0_12kDE.mat", {"X105_DE_time": files.vibration(36000)[:, None], "X105RPM": 1797})
    return folder


def made(folder: Path, runs: Any = with_cage) -> Matrix:
    add(folder)
    uncertainty = {"BPFO": 0.1, "BPFI": 0.1}
    return build_matrix(rig_recordings(), bearing=BEARING, model_runs=runs, model_uncertainty_pct=uncertainty)


def test_cells_hold_what_was_measured_and_the_rest_is_empty(folder: Path) -> None:
    matrix = made(folder)
    assert matrix.size == 160
    assert {(c.state, c.nominal_rpm, c.radial_kn) for c in matrix.cells} == {(s, 877.0, 124.8) for s in CODES.values()}
    assert matrix.at((State.OUTER, 124.8, 0.0, 353.0)) is None
    outer = matrix.at((State.OUTER, 124.8, 0.0, 877.0))
    assert outer is not None
    assert outer.detected
    assert outer.speed_source == "tachometer"
    assert outer.model_hz == pytest.approx(19 * CAGE * outer.shaft_rpm / 60)
    assert outer.error_pct == pytest.approx(100 * (outer.model_hz / outer.rig_hz - 1))
    assert outer.uncertainty_pct is not None
    assert outer.uncertainty_pct > 0.1
    assert abs(outer.deviation_pct or 9) < 0.3


def test_faults_are_called_against_the_healthy_cell(folder: Path) -> None:
    calls = {c.state: c.call for c in made(folder).cells}
    assert (calls[State.OUTER].basis, calls[State.OUTER].called) == (Basis.BASELINE, State.OUTER)
    assert calls[State.INNER].called is State.INNER
    assert calls[State.HEALTHY].called is None


def test_without_a_healthy_record_a_line_alone_cannot_tell(tmp_path: Path) -> None:
    rig_file(tmp_path, "OR")
    (cell,) = made(tmp_path).cells
    assert (cell.call.basis, cell.call.called) == (Basis.LINE_ALONE, None)


def test_failed_model_run_leaves_the_models_side_empty(folder: Path) -> None:
    matrix = made(folder, lambda analyses: ["the load was lost"] * len(analyses))
    assert all(c.model_hz is None and c.error_pct is None and c.remark == "the load was lost" for c in matrix.cells)
    assert {c.verdict for c in matrix.cells} <= {"insufficient data", NOT_DETECTED}


def test_maps_leave_empty_cells_empty(folder: Path, tmp_path: Path) -> None:
    section = matrix_section(SimpleNamespace(comparisons=(), matrix=made(folder)), tmp_path)  # type: ignore[arg-type]
    drawn, bias = ["Paragraph", "FigureGrid", "Table", "Paragraph"], ["Table", "FigureGrid"]
    assert [b.__class__.__name__ for b in section.blocks] == drawn + bias
    for kind in ("deviation", "detectability", "verdict"):
        lines = (tmp_path / f"matrix-{kind}.csv").read_text().splitlines()
        cells = [value for line in lines[1:] for value in line.split(",")[1:]]
        assert len(cells) == 160
        assert 1 <= sum(value != "" for value in cells) <= 3
        assert (tmp_path / f"matrix-{kind}.svg").stat().st_size > 5000


def test_empty_matrix_says_so(tmp_path: Path) -> None:
    matrix = build_matrix((), bearing=BEARING, model_runs=with_cage, model_uncertainty_pct={})
    section = matrix_section(SimpleNamespace(comparisons=(), matrix=matrix), tmp_path)  # type: ignore[arg-type]
    assert "all 160 cells are empty" in section.blocks[-1].text  # type: ignore[union-attr]
    assert not list(tmp_path.iterdir())


def test_other_rigs_are_read_apart_from_the_rig(folder: Path) -> None:
    (record,) = read_other_rigs(add(folder).recordings)
    assert (record.dataset, record.state, record.line, record.diagnosable) == ("cwru", State.INNER, "BPFI", True)
    assert (record.detected, record.shown) == (False, False)  # the made file holds noise
    evidence = SimpleNamespace(other_rigs=(record,))
    (section,) = other_rigs_section(evidence)  # type: ignore[arg-type]
    assert "0 of 1 race faults graded diagnosable (not " in section.blocks[2].text  # type: ignore[union-attr]
    said = " ".join(b.text for b in section.blocks if isinstance(b, Paragraph))
    assert "1 race-fault records have none: there a line alone cannot tell" in said
    assert other_rigs_section(SimpleNamespace(other_rigs=())) == ()  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.recordings
def test_open_recordings_show_their_faults(recordings_dir: Path) -> None:
    """Race faults by their published grade, in a band chosen on no record; healthy ones show none; near kinematics."""
    registered = [r for name in ("cwru", "mfpt", "hit_sm") for r in add(recordings_dir / name).recordings]
    records = [r for r in read_other_rigs(registered) if not r.refused]
    races = [r for r in records if r.line in ("BPFO", "BPFI") and r.state not in (None, State.HEALTHY)]
    assert len(races) >= 30
    plain = [r for r in races if (r.plain_grade or "").startswith("Y")]
    assert len(plain) >= 8
    assert all(r.shown for r in plain)
    graded = [r for r in races if r.diagnosable]  # by any method of the study: 197 by a kurtogram only
    assert sum(not r.shown for r in graded) <= 1
    held = [r for r in races if r.diagnosable is not False and not (r.plain_grade or "").startswith("N")]
    assert sum(r.shown for r in held) >= 0.95 * len(held)
    assert not [r.file for r in records if r.state is State.HEALTHY and (r.shown or r.call is None or r.call.indicated)]
    near = [abs(r.deviation_pct or 9) <= 0.5 for r in held if r.shown and r.speed_source != "nominal"]
    assert sum(near) >= 0.95 * len(near)


@pytest.mark.slow
@pytest.mark.recordings
def test_light_load_lets_the_cage_slip(recordings_dir: Path) -> None:
    """MFPT: inner and outer records agree on a cage that lags, least at the highest load."""
    records = [r for r in read_other_rigs(add(recordings_dir / "mfpt").recordings) if r.cage_pct is not None]
    loads = {race: sorted((r.radial_n, r.cage_pct) for r in records if r.line == race) for race in ("BPFO", "BPFI")}
    for race in loads.values():
        assert all(cage < 0 for _, cage in race)
        assert race[0][1] == min(cage for _, cage in race)
        assert race[-1][1] == max(cage for _, cage in race)
