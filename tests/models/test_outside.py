"""Models from outside: a failure is a status and leaves no process; a good run is like any other; the examples run."""

import json
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError, DataError, RunStatus, analyse, load_bearing, write_run
from srbval.models.outside.names import content_of
from srbval.models.outside.signals import SimulatedSignals, UnusableSignalsError, recorded_columns, signals_of
from srbval.models.simulate import Step, simulate, stored_run
from srbval.recordings import Origin, load_recording, recording_from_run
from srbval.scene import Scene, load_scene, paper_scene
from tests.marked import marked, until

MODELS = """
import os, subprocess, sys, time
from dataclasses import replace
import numpy as np
import srbval

SOLVERS = ("fine", "coarse")

def bundled(scene):
    run = srbval.simulate(replace(scene, model="impulse"))
    return {"time_s": run.time_s, "acceleration_m_s2": run.acceleration_m_s2, "cage_ratio": run.cage_ratio}

def times(scene):
    return np.arange(round((scene.settle_s + scene.duration_s) * scene.output_rate_hz)) / scene.output_rate_hz

def signal(scene):
    return np.sin(5000 * times(scene)) * np.exp(-5 * ((97 * times(scene)) % 1))

def ring(scene):
    return times(scene), signal(scene)
"""
FAILURES = {  # by name: what the function does, the run's status and reason
    "raises": ('raise ValueError("not today")', "raised", r"ValueError: not today, in models\.py line \d+"),
    "exits": ('sys.exit("enough")', "raised", "SystemExit: enough"),
    "not_finite": (
        "return times(scene), signal(scene) / (times(scene) < 0.00485)",
        "not-finite",
        "finite, the first at 0.0048",
    ),
    "uneven": (
        "return times(scene) ** 1.1, signal(scene)",
        "unusable-signals",
        "times are uneven, in steps of .* t_eval",
    ),
    "constant": ("return times(scene), 0 * times(scene) + 1", "silent", "constant although the bearing has a defect"),
    "short": ("return times(scene)[:-500], signal(scene)[:-500]", "unusable-signals", r"records 0\.1 s, after 0\.02 s"),
    "text": ('return "nothing"', "unusable-signals", r"it returned str; return \(time_s"),
    "sleeps": (
        'subprocess.Popen(["sleep", "600"]).wait()',
        "out-of-time",
        "did not end within 2 s; .*SRBVAL_MODEL_SECONDS",
    ),
    "grows": ("list(map(bytes, [10**6] * 10**6))", "out-of-memory", "more memory than 0.5 GB"),
    "dies": ("os._exit(7)", "died", "its process ended .exit code 7"),
}
MODELS += "".join(f"\ndef {name}(scene):\n    {body}\n" for name, (body, *_) in FAILURES.items())


@pytest.fixture(autouse=True)
def _model_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("models.py").write_text(MODELS, encoding="utf-8")
    mark = {"SRBVAL_TEST": f"outside {os.getpid()}"}
    monkeypatch.setenv("SRBVAL_TEST", mark["SRBVAL_TEST"])
    yield
    until(lambda: all("reader_process" in command for command in marked(mark).values()))


def scene(function: str = "ring", **changes: Any) -> Scene:
    return paper_scene(**{"model": f"models.py:{function}", "duration": "0.1 s", "defect": {"kind": "outer"}} | changes)


@pytest.mark.parametrize("function", FAILURES)
def test_a_failure_is_the_status_of_the_run(function, monkeypatch, capfd):
    monkeypatch.setenv("SRBVAL_MODEL_GB", "0.5")
    monkeypatch.setenv("SRBVAL_MODEL_SECONDS", "2" if function == "sleeps" else "120")
    _, status, reason = FAILURES[function]
    run = simulate(scene(function))
    assert run.status == status
    assert re.search(reason, run.reason), run.reason
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_model_that_calls_the_bundled_one_gives_its_numbers():
    own, bundled = simulate(scene("bundled")), simulate(scene(model="impulse"))
    assert np.array_equal(own.acceleration_m_s2, bundled.acceleration_m_s2)
    assert own.band_rms_m_s2 == bundled.band_rms_m_s2
    assert own.bpfo_hz == pytest.approx(bundled.bpfo_hz, rel=1e-12)  # a mean of equal numbers
    assert own.status is RunStatus.OK
    assert own.cpu_s > 0


def test_a_run_is_written_and_read_like_any_other(tmp_path):
    run = simulate(scene())
    write_run(run, tmp_path / "run.h5")
    record, read = recording_from_run(run), load_recording(tmp_path / "run.h5")
    for one in (record, read):
        assert one.origin is Origin.SIMULATED
        assert "models.py:ring" in one.name
        assert any("models.py:ring, which is not part of srbval" in note for note in one.notes)
    assert set(read.channels) == {"x", "y"}, "it gives no z"
    assert np.isnan(run.cage_ratio)
    assert np.isnan(run.drive_power_w)


def test_results_are_kept_under_the_content_of_the_sources():
    first = stored_run(scene())
    assert stored_run(scene()).stored_utc is not None
    Path("beside.py").write_text("FACTOR = 2\n", encoding="utf-8")
    changed = MODELS.replace("import srbval\n", "import beside, srbval\n").replace("np.sin", "beside.FACTOR * np.sin")
    Path("models.py").write_text(changed, encoding="utf-8")
    second = stored_run(scene())
    assert second.stored_utc is None
    assert np.array_equal(second.acceleration_m_s2[:, 0], 2 * first.acceleration_m_s2[:, 0])
    before = content_of("models.py:ring")
    Path("beside.py").write_text("FACTOR = 3\n", encoding="utf-8")
    assert content_of("models.py:ring") != before


def test_a_model_offers_its_own_solvers():
    assert simulate(scene()).scene.solver.name == "fine"
    assert simulate(scene(solver={"name": "coarse"})).scene.solver.name == "coarse"
    with pytest.raises(ConfigurationError, match="solver 'ode4' is not known; known: coarse, fine"):
        simulate(scene(solver={"name": "ode4"}))


@pytest.mark.parametrize(
    ("model", "error", "text"),
    [
        ("models.py:rings", ConfigurationError, "did you mean 'ring'"),
        ("models.py", ConfigurationError, "name its function too"),
        ("nowhere.py:ring", DataError, "no such file"),
        ("no_such_package.module:ring", DataError, "no Python package 'no_such_package'"),
        ("command ./nothing {out_csv}", ConfigurationError, "no executable program './nothing' is found"),
        (f"command {sys.executable}", ConfigurationError, "add {out_csv} for the file"),
    ],
)
def test_a_wrong_name_is_an_error_with_its_remedy(model, error, text):
    with pytest.raises(error, match=text):
        simulate(scene(model=model))


def test_a_program_reads_the_scene_and_writes_columns(srbval_text):
    Path("mysim.py").write_text(
        "import json, sys\nimport numpy as np\n"
        "scene = json.load(open(sys.argv[1]))\n"
        "time_s = np.arange(4000) / scene['output_rate_hz']\n"
        "signal = scene['load']['radial_n'] * np.sin(scene['orders']['bpfo'] * scene['shaft_speed_rad_s'] * time_s)\n"
        "table = np.column_stack([time_s, signal, 2 * signal])\n"
        "names = 'time_s,acceleration_x_m_s2,acceleration_y_m_s2'\n"
        "np.savetxt(sys.argv[2], table, delimiter=',', header=names, comments='', fmt='%.9g')\n",
        encoding="utf-8",
    )
    text = f"{sys.executable} mysim.py {{scene_json}} {{out_csv}}"
    words = ["simulate", "--seconds", "0.1", "--defect", "outer", "--json", "-o", "run.h5", "--model-command", text]
    said = srbval_text(*words)
    document = json.loads(said.out)
    assert document["model"] == f"command {text}"
    assert document["status"] == "ok"
    assert document["cage_ratio"] is None
    assert "run only what you trust" in said.err
    assert load_recording("run.h5").channels["y"].max() == pytest.approx(2 * 124.8e3, rel=0.01)
    Path("mysim.py").write_text("raise SystemExit('no licence')", encoding="utf-8")
    assert "exit code 1 and wrote no signals: no licence" in srbval_text(*words, code=4).err


def test_a_campaign_runs_it_and_names_its_failures(srbval_json):
    kinds = '[[axes]]\nkind = "list"\ncases = [{ "defect.kind" = "outer" }, { model = "models.py:raises" }]'
    Path("own.toml").write_text(f'name = "own"\n[scene]\nduration = "0.1 s"\n{kinds}\n', encoding="utf-8")
    document = srbval_json("campaign", "run", "own.toml", "--model", "models.py:bundled", "--jobs", "1", code=1)
    assert document["cases"] == 2
    assert [(one["status"], "not today" in one["reason"]) for one in document["failed"]] == [("raised", True)]
    assert "bpfo_hz" in Path(document["table"]).read_text(encoding="utf-8")


def test_forms_of_signals():
    xarray = pytest.importorskip("xarray")
    one = scene()
    fine = np.arange(3 * (one.samples + 50)) / (3 * one.output_rate_hz)
    angle = 0.43 * one.shaft_speed_rad_s * fine
    signal = np.cos(300 * fine)
    both = np.stack([signal, 2 * signal], axis=1)
    data = xarray.Dataset({"acceleration_m_s2": (("time", "axis"), both)}, {"time": fine}).assign(
        cage_angle_rad=("time", (angle + np.pi) % (2 * np.pi) - np.pi)
    )
    out = recorded_columns(signals_of(data), one)
    assert out[:, 0] == pytest.approx(signal[150:].reshape(-1, 3).mean(axis=1))
    assert out[:, 1] == pytest.approx(2 * out[:, 0])
    assert np.isnan(out[:, 2]).all()
    assert out[:, 6] == pytest.approx(0.43 * one.shaft_speed_rad_s)
    along = recorded_columns(SimulatedSignals(fine, signal, drive_power_w=500.0), one)
    assert (along[:, 0] + along[:, 1]) / np.sqrt(2) == pytest.approx(out[:, 0])
    assert along[0, 13] == pytest.approx(500.0)
    healthy = replace(one, defect=paper_scene().defect)
    silent = recorded_columns(SimulatedSignals(fine, 0 * signal), healthy)
    assert (silent[:, 0] == 0).all(), "a healthy bearing may be silent"
    with pytest.raises(UnusableSignalsError) as caught:
        recorded_columns(SimulatedSignals(np.linspace(0, 0.2, 5001), np.ones(5001)), one)
    assert "its rate of 25000 Hz is no multiple" in caught.value.args[1]


FOLDER = Path(__file__).parents[2] / "notebooks" / "models"
BALANCE = 0.03  # of the ring's displacement, which moves by 2 %; a contact twice as stiff would be 6 % away
SLIP = 0.001  # of the cage ratio in 20 ms, in which the outer race is passed once and a half
LINE_HZ = 0.04  # of a line in a record of 0.27 s


def test_two_degrees_of_freedom_show_the_kinematic_line():
    changes = {"shaft_speed": "3000 rpm", "duration_s": 0.27, "settle_s": 0.01, "defect": {"kind": "outer"}}
    changes |= {"solver": {"name": "RK45", "step_s": 1 / 20480}}
    run = simulate(load_scene("rig", {"model": f"{FOLDER / 'two_dof.py'}:simulate"} | changes))
    assert run.status is RunStatus.OK, run.reason
    found = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing)).line("BPFO")
    assert found.detected
    assert found.found_hz == pytest.approx(run.bpfo_hz, abs=LINE_HZ)


def test_mujoco_stays_where_the_static_balance_puts_it():
    pytest.importorskip("mujoco")
    changes = {"duration_s": 0.015, "settle_s": 0.005, "defect": {"kind": "outer"}}
    run = simulate(paper_scene(model=f"{FOLDER / 'mujoco_bearing.py'}:simulate", **changes))
    assert run.status is RunStatus.OK, run.reason
    usual = simulate(paper_scene(**changes), step=Step.UNCHECKED)
    assert run.displacement_m[:, 1].mean() == pytest.approx(usual.displacement_m[:, 1].mean(), rel=BALANCE)
    assert run.cage_ratio == pytest.approx(0.4315, abs=SLIP)
