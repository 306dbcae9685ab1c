"""A benchmark from end to end, on runs too short to mean anything; no wall time is asserted."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from srbval.cli import main
from srbval.models.health import default_solver
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import SCHEMA_VERSION
from srbval.studies.scenes import bench_scene
from srbval.studies.speed_accuracy import study as bench
from srbval.studies.speed_accuracy.runs import (
    ERRORS,
    MEASURES,
    BenchSettings,
    compared,
    errors_against,
    references,
    timed_row,
    with_accuracy,
    with_pareto,
)
from srbval.studies.speed_accuracy.study import run_bench
from tests.studies import stored_in

TINY = BenchSettings(
    timing_s=0.002, timing_settle_s=0.0, repeats=1, accuracy_s=0.01, accuracy_settle_s=0.0, reference_budget_s=0.0,
    steps=(61440,),
)  # fmt: skip
ROW_KEYS = {"scene", "model", "solver", "dt_s", "wall_per_simulated_s", "cage_error", "noise_floor", "band_rms_error",
            "status", "pareto"}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("references")


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, Any]:
    with stored_in(folder):
        bench = run_bench(scenes=("play0-outer",), solvers=("ode4", "imex2"), settings=TINY)
    content: dict[str, Any] = to_json(bench)
    return content


def test_document(result: dict[str, Any]) -> None:
    assert [r["solver"] for r in result["runs"]] == ["ode4", "imex2"]
    for row in result["runs"]:
        assert set(row) >= ROW_KEYS
        assert row["noise_floor"] is None, "of a record so short"
    assert result["runs"][0]["rhs_per_simulated_s"] == pytest.approx(4 * 61440)
    assert result["reference"]["play0-outer"]["dt_s"] == pytest.approx(1 / 122880)
    assert any(r["pareto"] for r in result["runs"])


def test_a_converged_run_is_kept_and_said_to_be(result: dict[str, Any], folder: Path, tmp_path: Path) -> None:
    with stored_in(folder):
        again = references(["play0-outer"], TINY)["play0-outer"]
    assert again == result["reference"]["play0-outer"] | {"cached": True}
    (kept,) = folder.iterdir()
    (tmp_path / kept.name).write_text("half a fi")
    with stored_in(tmp_path):
        assert not references(["play0-outer"], TINY)["play0-outer"]["cached"]


def test_a_failed_converged_run_is_said_and_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbval.studies.speed_accuracy.runs.default_solver", lambda: "ode9")
    with stored_in(tmp_path):
        found = references(["play0-outer"], TINY)["play0-outer"]
    assert (found["status"], found["cage_ratio"], found["own_cage_error"]) == ("refused", None, None)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def failed(folder: Path) -> list[dict[str, Any]]:
    """Euler at three times the paper's step throws its rollers clear; an unknown method is not begun."""
    scenes = [
        bench_scene("play0-outer", solver=solver, step_s=1 / 20480, seconds=0.002, settle_s=0.0)
        for solver in ("ode1", "ode9")
    ]
    with stored_in(folder):
        found = references(["play0-outer"], TINY)
    return with_accuracy([timed_row("play0-outer", one, 1) for one in scenes], found, replace(TINY, accuracy_s=0.2))


def test_a_failed_run_stays_a_row(failed: list[dict[str, Any]]) -> None:
    thrown, refused = failed
    assert thrown["status"] not in ("ok", "refused")
    assert thrown["reason"]
    assert (refused["status"], refused["wall_per_simulated_s"]) == ("refused", None)
    for row in failed:
        assert set(row) >= ROW_KEYS
        assert (row["cage_error"], row["pareto"]) == (None, False)


def test_a_converged_run_is_not_compared_with_itself(result: dict[str, Any]) -> None:
    """Its error would be zero, and the best on the chart."""
    reference = result["reference"]["play0-outer"]
    row = result["runs"][0] | {"solver": default_solver(), "dt_s": 1 / 122880}
    own = compared(row, {key: reference[key] for key in ("status", "reason", *MEASURES)}, reference)
    assert (own["cage_error"], own["cage_error_bound"], own["reference_limited"]) == (None, None, False)


def test_an_error_below_the_converged_runs_own_is_said_to_be(result: dict[str, Any]) -> None:
    reference, row = result["reference"]["play0-outer"], result["runs"][0]
    lucky = compared(row, {key: reference[key] for key in ("status", "reason", *MEASURES)}, reference)
    assert lucky["cage_error"] == 0
    assert (lucky["reference_limited"], lucky["cage_error_bound"]) == (True, reference["own_cage_error"])


def measures(**changes: Any) -> dict[str, Any]:
    own = {"seconds": 4.0, "cage_ratio": 0.43, "cage_scatter": 1e-5, "defect_hz": 97.0, "noise_floor": 1e-3,
           "band_rms_m_s2": 1.4, "harmonics": (1, 0.5, 0.3, 0.2, 0.1)}  # fmt: skip
    return own | changes


def test_errors_are_relative_and_without_sign_and_what_is_missing_has_none() -> None:
    worse = measures(
        cage_ratio=0.43 * 0.999, band_rms_m_s2=1.4 * 1.1, noise_floor=5e-3, harmonics=(1, 0.5, 0.6, 0.2, 0)
    )
    assert errors_against(worse, measures()) == pytest.approx(
        {"cage_error": 1e-3, "band_rms_error": 0.1, "noise_floor_ratio": 5.0, "harmonic_error": 0.3,
         "defect_hz_error": 0.0}
    )  # fmt: skip
    bare = errors_against(measures(defect_hz=None, noise_floor=None, harmonics=None), measures())
    assert [bare[name] for name in ("defect_hz_error", "noise_floor_ratio", "harmonic_error")] == [None] * 3


def row(scene: str, wall: float, cage: float, band: float, status: str = "ok", **of: Any) -> dict[str, Any]:
    step = {"model": "full", "solver": "ode4", "dt_s": 1 / 61440, "wall_per_simulated_s": wall, "status": status}
    errors = dict.fromkeys(ERRORS) | {"cage_error": cage, "cage_error_bound": cage, "band_rms_error": band}
    return {"scene": scene, **step, **errors, "noise_floor": None, **of}


@pytest.mark.parametrize("extra", [["--speed-only", "--json"], ["--all"]])
def test_command(
    extra: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(bench, "QUICK", TINY)
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda kind: tmp_path / kind)
    assert main(["bench", "--quick", "--scenes", "play0-healthy", "--solvers", "ode4", *extra]) == 0
    said = capsys.readouterr()
    assert "Speed accuracy: time the solvers" in said.err
    if "--all" in extra:
        assert "reference" in said.out
        assert "0 of them close enough" in said.out
        return
    document: dict[str, Any] = json.loads(said.out)
    assert (document["status"], document["schema_version"]) == ("ok", SCHEMA_VERSION)
    assert document["reference"] == {}
    assert all(set(row) >= ROW_KEYS for row in document["runs"])


def test_each_scene_has_its_own_front_and_failed_runs_are_on_none() -> None:
    rows = [
        row("play0-outer", 1.0, 1e-4, 0.1),
        row("play0-outer", 2.0, 1e-5, 0.2),
        row("play0-outer", 0.1, 0.0, 0.0, status="cage-lost"),
        row("interference-outer", 9.0, 1e-1, 0.9),
    ]
    flagged = with_pareto(rows)
    assert [r["pareto"] for r in flagged] == [True, True, False, True]
    assert [r["pareto_band"] for r in flagged] == [True, False, False, True]
