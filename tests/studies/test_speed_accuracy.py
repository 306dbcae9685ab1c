"""The benchmark from end to end on short runs; no time is asserted."""

from argparse import Namespace
from pathlib import Path
from typing import Any

import pytest

from srbval.models.run import works
from srbval.models.simulate import Step, simulate
from srbval.progress import silent
from srbval.report.prose import Prose
from srbval.storage.json_files import to_json
from srbval.studies.harness import StudyResult
from srbval.studies.speed_accuracy import study
from srbval.studies.speed_accuracy.page import blocks
from srbval.sweep.scenes import bench_scene

TINY = ((20480, 61440), 0.002, 0.25)  # extent of the runs
ROW_KEYS = {"scene", "model", "solver", "dt_s", "wall_per_simulated_s", "cpu_per_simulated_s", "cage_error", "status",
            "noise_floor", "band_rms_error", "band_rms_error_db", "ok", "pareto"}  # fmt: skip


@pytest.fixture(scope="module")
def result(_own_results):
    asked = Namespace(scenes=["interference-outer"], solvers=["ode1", "imex2"], jobs=None)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(study, "EXTENT", TINY)
        content: dict[str, Any] = to_json(study.run(asked, silent).content)
    return content


def test_document(result):
    assert [(r["solver"], round(1 / r["dt_s"])) for r in result["runs"]] == [
        ("ode1", 20480), ("ode1", 61440), ("imex2", 20480), ("imex2", 61440),
    ]  # fmt: skip
    assert all(set(row) >= ROW_KEYS for row in result["runs"])
    assert result["reference"]["interference-outer"]["dt_s"] == pytest.approx(1 / 245760)
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
    scene = bench_scene("interference-outer", solver="imex2", step_s=good["dt_s"], seconds=0.25, settle_s=0.0625)
    assert simulate(scene, step=Step.CHECKED).status == good["status"]


def test_page_and_command(result, srbval_json, srbval_text, monkeypatch, tmp_path):
    _, figure, table = blocks(Prose("srbval.studies.speed_accuracy"), result)
    figure.draw(tmp_path, "chart")
    assert (tmp_path / "chart.svg").is_file()
    assert len(table.rows) >= 1
    asked, found = list[Any](), StudyResult(content=result, text="")
    monkeypatch.setattr(study, "bench", lambda **given: asked.append(given) or found)
    monkeypatch.chdir(tmp_path)
    document = srbval_json("bench", "--solvers", "ode4", "--plot", "own.svg")
    assert (document["status"], len(document["runs"])) == ("ok", 4)
    assert asked[0]["solvers"] == ["ode4"]
    assert Path("own.svg").is_file()
    said = srbval_text("bench", "--scenes", "interference-outer")
    assert "of 4 runs work" in said.out
    assert said.err.startswith("the stored result took ")
    assert Path("srbval-bench.svg").is_file()
