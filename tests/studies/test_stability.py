"""A small map from end to end: planted failures are caught by the runs, converged ones are not flagged."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from srbval.studies.stability.outcome import outcome_store

from srbval.cli import main, stability_command
from srbval.errors import ConfigurationError
from srbval.scene import paper_scene
from srbval.storage.strict_json import json_object
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.stability import outcome as outcome_module
from srbval.studies.stability.cell import CAGE_LIMIT, LOAD_RANGE, PLANTED, PLANTED_RPM
from srbval.studies.stability.grid import FULL, StabilityGrid
from srbval.studies.stability.study import StabilityResult, run_stability

# The planted failures at both critical velocities, with references cheaper than the real map's.
PLANTED_GRID = replace(
    FULL, scenes=("play0-outer",), solvers=("ode1", "ode2"), steps_per_s=(30720, 15360), rpm=PLANTED_RPM,
    reference_steps_per_s=245760,
)  # fmt: skip
CONVERGED = 1e-4  # cage speed at twice the reference's step: a hundredth of the limit for cells
ROUNDING = 1e-6  # samples
CELL_KEYS = {"model", "solver", "dt_s", "rpm", "status", "reason", "predicted_limit_dt_s"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stability")


@pytest.fixture(scope="module")
def result(folder: Path) -> StabilityResult:
    return run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=folder))


def test_every_planted_failure_is_caught_by_the_run_itself(result: StabilityResult) -> None:
    assert len(result.planted) == len(PLANTED) * len(PLANTED_RPM) * len(PLANTED_GRID.critical_velocity_m_s)
    assert [p for p in result.planted if not p.caught] == []


def test_no_converged_run_is_flagged(result: StabilityResult) -> None:
    assert [r.fine.reason for r in result.references if r.flagged] == []
    assert all(r.own_cage_error < CONVERGED for r in result.references)
    assert result.sound


def test_what_is_ok_is_like_the_converged_run(result: StabilityResult) -> None:
    for cell in result.cells:
        assert not cell.ok or (cell.cage_error <= CAGE_LIMIT and cell.load_part >= LOAD_RANGE[0])
        assert cell.ok or cell.reason


def test_document(result: StabilityResult) -> None:
    document = json_object(result)
    assert all(set(cell) >= CELL_KEYS for cell in document["cells"])
    counts = document["counts"]
    assert counts["cells"] == 16
    found = ("ok", "inaccurate", "caught_by_the_run", "seen_by_comparison_only")
    assert counts["cells"] == sum(counts[name] for name in found)
    assert {cell["critical_velocity_m_s"] for cell in document["cells"]} == {0.001, 0.5}


def test_what_was_run_is_not_run_again(result: StabilityResult, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise AssertionError("a stored run was made again")

    monkeypatch.setattr(outcome_module, "run_all", refuse)
    again = run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=folder))
    assert [c.to_dict() for c in again.cells] == [c.to_dict() for c in result.cells]


def test_an_interrupted_map_continues(result: StabilityResult, folder: Path, tmp_path: Path) -> None:
    stored = sorted(folder.glob("*.json"))
    for path in stored[: len(stored) // 2]:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / stored[-1].name).write_text("{}", encoding="utf-8")
    again = run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=tmp_path))
    assert [c.status for c in again.cells] == [c.status for c in result.cells]
    assert len(list(tmp_path.glob("*.json"))) == len(stored)


def test_default_solver_and_the_paper_s_step_are_in_the_map() -> None:
    scene = paper_scene()
    assert scene.solver.name in FULL.solvers
    assert round(1 / PAPER_STEP_S) in FULL.steps_per_s
    assert round(1 / scene.solver.step_s) in FULL.steps_per_s


def test_runs_of_a_group_have_one_length_whatever_their_step() -> None:
    lengths = {(s.duration_s, s.settle_s) for s in (FULL.scene(c) for c in FULL.cases if c.group.rpm == 127.0)}
    assert len(lengths) == 1
    for case in FULL.cases:
        samples = FULL.scene(case).duration_s * FULL.scene(case).output_rate_hz
        assert samples == pytest.approx(round(samples), abs=ROUNDING)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"scenes": ("nowhere",)}, "nowhere"),
        ({"solvers": ("ode9",)}, "ode9"),
        ({"rpm": (-1.0,)}, "rpm"),
        ({"steps_per_s": (0,)}, "steps-per-s"),
    ],
)
def test_a_wrong_grid_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        replace(FULL, **changes)


def test_command(
    result: StabilityResult, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[StabilityGrid] = []

    def made(grid: StabilityGrid, **_: Any) -> StabilityResult:
        asked.append(grid)
        return result

    monkeypatch.setattr(stability_command, "run_stability", made)
    assert main(["stability", "--quick", "--rpm", "710", "3000", "--json", "-o", str(tmp_path / "s.json")]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["kind"], len(document["cells"])) == ("stability", 16)
    assert asked[0].rpm == (710.0, 3000.0)
    kept = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert kept["made_utc"] == document["made_utc"]
    assert {"processor", "usable_cores"} <= set(kept["machine"])
    assert main(["stability", "--quick"]) == 0
    said = capsys.readouterr().out
    assert "planted failures caught by the runs themselves: 12 of 12" in said
    assert "too-deep" in said


def test_command_says_what_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "--solvers", "ode9"]) == 2
    assert "ode4" in capsys.readouterr().err
