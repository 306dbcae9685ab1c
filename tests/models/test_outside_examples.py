"""The models in `notebooks/models` run, and each shows a number that is known."""

from pathlib import Path

import numpy as np
import pytest

from srbval import RunStatus, analyse, load_bearing, load_scene, paper_scene, recording_from_run, simulate

FOLDER = Path(__file__).parents[2] / "notebooks" / "models"
BALANCE = 0.03  # of the ring's displacement, which moves by 2 %; a contact twice as stiff would be 6 % away
SLIP = 0.001  # of the cage ratio in 20 ms, in which the outer race is passed once and a half
LINE_HZ = 0.1  # of a line in a record of 0.7 s


def test_two_degrees_of_freedom_show_the_kinematic_line():
    changes = {"duration_s": 0.7, "defect": {"kind": "outer"}, "solver": {"name": "RK23", "step_s": 1 / 20480}}
    run = simulate(load_scene("rig", {"model": f"{FOLDER / 'two_dof.py'}:simulate"} | changes))
    assert run.status is RunStatus.OK, run.reason
    found = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing)).line("BPFO")
    assert found.detected
    assert found.found_hz == pytest.approx(run.bpfo_hz, abs=LINE_HZ)


def test_two_degrees_of_freedom_carry_the_load_at_rest():
    run = simulate(load_scene("rig", {"model": f"{FOLDER / 'two_dof.py'}:simulate", "duration_s": 0.02}))
    held = run.displacement_m[:, 1]
    assert held.mean() < 0, "the load pushes the ring down"
    assert np.ptp(held) < BALANCE * abs(held.mean())


def test_mujoco_stays_where_the_static_balance_puts_it():
    pytest.importorskip("mujoco")
    changes = {"duration_s": 0.015, "settle_s": 0.005, "defect": {"kind": "outer"}}
    run = simulate(paper_scene(model=f"{FOLDER / 'mujoco_bearing.py'}:simulate", **changes))
    assert run.status is RunStatus.OK, run.reason
    usual = simulate(paper_scene(**changes))
    assert run.displacement_m[:, 1].mean() == pytest.approx(usual.displacement_m[:, 1].mean(), rel=BALANCE)
    assert run.cage_ratio == pytest.approx(0.4315, abs=SLIP)


def test_without_its_engine_a_model_says_so(monkeypatch, tmp_path):
    text = (FOLDER / "mujoco_bearing.py").read_text(encoding="utf-8").replace("import mujoco", "import no_such_engine")
    (tmp_path / "bearing.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    run = simulate(paper_scene(model="bearing.py:simulate", duration_s=0.01))
    assert run.status is RunStatus.RAISED
    assert "ModuleNotFoundError: No module named 'no_such_engine'" in run.reason
