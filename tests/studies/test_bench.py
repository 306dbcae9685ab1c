"""Models in the chart and in the map: its own errors, its cost in turns, failures never fast, Ctrl-C."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.storage.stored_result import ResultKind, read_result
from srbval.studies import scale
from srbval.studies.bench import errors, judge_step_error, with_fronts
from tests.marked import marked, until

MODELS = '''
import time
import numpy as np
from srbval import load_bearing

SOLVERS = ("euler",)

def simulate(scene):
    """A ring on a spring, pushed at every passage, by semi-implicit Euler at the scene's step."""
    orders, dt = load_bearing(scene.bearing).orders, scene.solver.step_s
    every = 1 / orders.at(scene.shaft_hz).bpfo_hz
    time_s = np.arange(round((scene.settle_s + scene.duration_s) / dt)) * dt
    x = v = 0.0
    acceleration = np.empty(len(time_s))
    for i, push in enumerate(np.where(time_s % every < 1e-3, 1e3, 0.0)):
        acceleration[i] = (push - 9e9 * x - 2e4 * v) / 75
        v += dt * acceleration[i]
        x += dt * v
    return {"time_s": time_s, "acceleration_m_s2": acceleration, "cage_ratio": orders.ftf}

def at_any_step(scene):
    time_s = np.arange(round((scene.settle_s + scene.duration_s) * scene.output_rate_hz)) / scene.output_rate_hz
    return time_s, np.cos(6000 * time_s)

def raises(scene):
    raise ValueError("no licence")

def sleeps(scene):
    time.sleep(600)
'''
LIMIT_S = 2 / (9e9 / 75) ** 0.5  # of semi-implicit Euler without damping, with which it is longer


@pytest.fixture(autouse=True)
def _model_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("models.py").write_text(MODELS, encoding="utf-8")


@pytest.mark.usefixtures("_results_of_the_module")
def test_the_chart_has_the_cost_in_turns_and_both_errors(srbval_json):
    found = srbval_json("bench", "--model", "models.py:simulate", "--quick")
    own, usual = (next(row for row in found["runs"] if row["solver"] == name) for name in ("euler", "imex2"))
    assert found["model"] == own["model"] == "models.py:simulate"
    assert own["status"] == "ok"
    assert own["dt_s"] == pytest.approx(1 / 61440)
    low, high = own["cpu_ratio_range"]
    assert 0 < low <= own["cpu_ratio"] <= high
    assert usual["cpu_ratio"] == pytest.approx(1, abs=0.5)
    assert own["cage_error"] == 0
    assert own["band_rms_error"] < 0.05 < own["bundled_band_rms_error"]
    assert own["line_error_pct"] == 0
    assert own["ok"]
    assert own["pareto"] or usual["pareto"]
    assert found["seconds_planned"] > 0
    assert "euler" in Path("srbval-bench.svg").with_suffix(".csv").read_text(encoding="utf-8")


def test_the_quick_chart_of_the_bundled_model_goes_on_where_it_was_stopped(srbval_text, srbval_json):
    first = srbval_text("bench", "--quick", "--solvers", "imex2", "ode4")
    said = [line for line in first.err.splitlines() if not line.startswith("Speed accuracy")]
    assert re.match(r"about \d+ s(, \d+ s of it to compile the solvers once)?; stop with Ctrl-C", said[0])
    assert [line.split()[1] for line in said[1:]] == ["solver", "imex2", "ode4"], "a line as each ends"
    found = srbval_json("bench", "--quick", "--solvers", "imex2", "ode4", "ode1")
    assert [row["ok"] for row in found["runs"]] == [True, False, False]
    assert srbval_text("bench", "--quick", "--solvers", "imex2", "ode4").out == first.out, "costs are read, too"


def test_errors_are_relative_and_what_is_missing_has_none():
    right = {"cage_ratio": 0.43, "band_rms_m_s2": 1.4}
    expected = {"cage_error": 1e-3, "line_error_pct": 0.1, "band_rms_error": 9.0, "band_rms_error_db": 20.0}
    found = errors({"cage_ratio": 0.43 * 0.999, "band_rms_m_s2": 1.4 * 10}, right)
    assert found == pytest.approx(expected)
    assert errors({"cage_ratio": 0.43, "band_rms_m_s2": None}, right)["band_rms_error_db"] is None


def row(scene: str, cost: float | None, cage: float | None, ok: bool = True) -> dict[str, Any]:
    return {"scene": scene, "cpu_per_simulated_s": cost, "cage_error": cage, "ok": ok}


def test_each_scene_has_its_own_front_and_failed_runs_are_on_none():
    rows = [row("a", 1.0, 1e-4), row("a", 2.0, 1e-5), row("a", 2.0, 1e-3), row("a", 0.1, 0.0, ok=False),
            row("b", 9.0, 1e-1), row("a", None, 1e-9)]  # fmt: skip
    assert [r["pareto"] for r in with_fronts(rows, "cage_error")] == [True, True, False, False, True, False]


def test_ok_never_stands_beside_an_error_beyond_its_limit():
    right = {"cage_ratio": 0.43, "band_rms_m_s2": 1.0}
    row = {"model": "", "solver": "imex2", "status": "ok", "reason": ""}
    for factor, status in ((1.04, "ok"), (0.96, "ok"), (1.136, "inaccurate"), (1 / 1.205, "inaccurate")):
        found = judge_step_error(row | right | {"band_rms_m_s2": factor}, right)
        assert (found["status"], found["ok"]) == (status, status == "ok")
    assert "its step errors are 1.62 dB of the level; accepted are at most 0.1 % of the line" in found["reason"]


@pytest.mark.usefixtures("_results_of_the_module")
def test_a_failed_model_is_a_row_with_its_reason_and_no_cost(srbval_json):
    found = srbval_json("bench", "--model", "models.py:raises", "--quick")
    own = next(row for row in found["runs"] if row["model"] == "models.py:raises")
    assert own["status"] == "raised"
    assert "no licence" in own["reason"]
    assert not own["pareto"]
    assert own.get("cpu_per_simulated_s") is None
    assert any(row["ok"] for row in found["runs"] if row["model"] == "full")


def test_the_map_finds_the_largest_step_of_the_model_itself(srbval_json, srbval_text):
    (limit,) = srbval_json("stability", "--model", "models.py:simulate", "--quick")["limits"]
    assert limit["solver"] == "euler"
    assert limit["rpm"] == 710.0
    assert 1 / 61440 <= limit["largest_stable_dt_s"] < LIMIT_S
    assert limit["predicted_limit_dt_s"] is None
    drawn = Path("srbval-stability.csv").read_text(encoding="utf-8")
    assert "models.py:simulate euler" in drawn
    assert "imex2" in drawn, "beside the default of the stored map"
    said = srbval_text("stability", "--model", "models.py:at_any_step", "--quick").out
    assert "does the model use scene.solver.step_s?" in said


def test_what_a_busy_machine_may_cause_is_not_kept(srbval_json, monkeypatch):
    words = ("stability", "--model", "models.py:at_any_step", "--quick")
    monkeypatch.setenv("SRBVAL_MODEL_SECONDS", "0.01")
    assert {cell["status"] for cell in srbval_json(*words)["cells"]} == {"out-of-time"}
    monkeypatch.delenv("SRBVAL_MODEL_SECONDS")
    assert {cell["status"] for cell in srbval_json(*words)["cells"]} == {"ok"}


def test_ctrl_c_ends_the_model_too():
    mark = {"SRBVAL_TEST": f"bench {os.getpid()}"}
    words = [sys.executable, "-m", "srbval", "stability", "--model", "models.py:sleeps", "--quick"]
    process = subprocess.Popen(words, env=os.environ | mark, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    until(lambda: len(marked(mark)) == 2)
    process.send_signal(signal.SIGINT)
    assert "interrupted" in process.communicate(timeout=30)[1].decode()
    until(lambda: not marked(mark), within_s=2.0)


def test_costs_by_size_are_those_of_the_command_alone(monkeypatch, srbval_json, srbval_text, tmp_path):
    """Without this process's memory and its start in the cost per unit; a command that fails ends all."""
    held = np.ones(2**26)  # 512 MB, which a copy of this process would show
    record = scale.TABLE["series"]["a record, by minutes"] | {"sizes": [0.02, 0.03]}
    monkeypatch.setattr(scale, "COMPILING", "kinematics")
    monkeypatch.setitem(scale.TABLE, "series", {"a": record})
    first, second = srbval_json("bench", "--scale", "-o", tmp_path / "scale.json")["rows"]
    assert 0.2 < second["cpu_s"] < second["wall_s"] * 4
    assert 30 < second["memory_mb"] < held.nbytes / 2**20
    assert second["cpu_per_unit_s"] == pytest.approx((second["cpu_s"] - first["cpu_s"]) / 0.01)
    assert read_result(tmp_path / "scale.json").kind is ResultKind.DOCUMENT
    monkeypatch.setattr(scale, "COMPILING", "analyse none.npy")
    assert "no such file" in srbval_text("bench", "--scale", "--quick", code=4).err
