"""The benchmark from end to end on short runs; no time is asserted."""

from pathlib import Path
from typing import Any

import pytest

from srbval.models.run import works
from srbval.models.simulate import Step, simulate
from srbval.report.prose import Prose
from srbval.storage.json_files import to_json
from srbval.studies.speed_accuracy import study
from srbval.studies.speed_accuracy.page import blocks
from srbval.sweep.scenes import bench_scene

TINY = study.Settings(
    steps_per_s=(20480, 61440), converged=122880, timed_s=0.002, repeats=1, compared_s=0.25, settle_s=0.0
)
ROW_KEYS = {"scene", "model", "solver", "dt_s", "wall_per_simulated_s", "cpu_per_simulated_s", "cage_error", "status",
            "noise_floor", "band_rms_error", "band_rms_error_db", "ok", "pareto"}  # fmt: skip


@pytest.fixture(scope="module")
def result(_own_results):
    found = study.run_bench(scenes=("interference-outer",), solvers=("ode1", "imex2"), settings=TINY)
    content: dict[str, Any] = to_json(found)
    return content


def test_document(result):
    assert [(r["solver"], round(1 / r["dt_s"])) for r in result["runs"]] == [
        ("ode1", 20480), ("ode1", 61440), ("imex2", 20480), ("imex2", 61440),
    ]  # fmt: skip
    assert all(set(row) >= ROW_KEYS for row in result["runs"])
    assert result["reference"]["interference-outer"]["dt_s"] == pytest.approx(1 / 122880)
    assert result["reference"]["interference-outer"]["own_cage_error"] > 0
    assert result["runs"][3]["mark"] == "the default"
    assert any(row["pareto"] for row in result["runs"])
    assert result["seconds_planned"] > 0


def test_a_run_ends_as_simulate_does(result):
    thrown, *_, good = result["runs"]
    assert (thrown["ok"], thrown["cage_error"], thrown["pareto"]) == (False, None, False)
    assert thrown["reason"]
    for row in result["runs"]:
        assert row["ok"] == works(row["status"])
    scene = bench_scene("interference-outer", solver="imex2", step_s=good["dt_s"], seconds=0.25, settle_s=0.0)
    assert simulate(scene, step=Step.CHECKED).status == good["status"]


def test_errors_are_relative_and_what_is_missing_has_none():
    right = {"cage_ratio": 0.43, "band_rms_m_s2": 1.4}
    found = study.errors({"cage_ratio": 0.43 * 0.999, "band_rms_m_s2": 1.4 * 10}, right)
    assert found == pytest.approx({"cage_error": 1e-3, "band_rms_error": 9.0, "band_rms_error_db": 20.0})
    assert study.errors({"cage_ratio": 0.43, "band_rms_m_s2": None}, right)["band_rms_error_db"] is None


def row(scene: str, cost: float | None, cage: float | None, ok: bool = True) -> dict[str, Any]:
    return {"scene": scene, "cpu_per_simulated_s": cost, "cage_error": cage, "ok": ok}


def test_each_scene_has_its_own_front_and_failed_runs_are_on_none():
    rows = [row("a", 1.0, 1e-4), row("a", 2.0, 1e-5), row("a", 2.0, 1e-3), row("a", 0.1, 0.0, ok=False),
            row("b", 9.0, 1e-1), row("a", None, 1e-9)]  # fmt: skip
    assert [r["pareto"] for r in study.with_fronts(rows)] == [True, True, False, False, True, False]


def test_page_and_command(result, srbval_json, srbval_text, monkeypatch, tmp_path):
    _, figure, table = blocks(Prose("srbval.studies.speed_accuracy"), result)
    figure.draw(tmp_path, "chart")
    assert (tmp_path / "chart.svg").is_file()
    assert len(table.rows) >= 1
    asked: list[Any] = []
    monkeypatch.setattr(study, "run_bench", lambda **given: asked.append(given) or result)
    monkeypatch.chdir(tmp_path)
    document = srbval_json("bench", "--solvers", "ode4", "--plot", "own.svg")
    assert (document["status"], len(document["runs"])) == ("ok", 4)
    assert asked[0]["solvers"] == ("ode4",)
    assert Path("own.svg").is_file()
    said = srbval_text("bench", "--scenes", "interference-outer")
    assert "of 4 runs work" in said.out
    assert said.err.startswith("about 6 minutes on two cores")
    assert Path("srbval-bench.svg").is_file()
