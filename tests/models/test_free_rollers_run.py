"""Runs with rollers that tilt and slide along their axes, under axial load."""

import pytest

from srbval.errors import ConfigurationError
from srbval.models.run import RunStatus
from srbval.models.simulate import Step, simulate
from srbval.scene import load_scene

CLOSED = 1e-3  # of the losses
SHARE, SHARE_OFF = 0.244, 0.01  # of row 1: the closed form of `test_free_rollers`; rollers come and go
AXIAL = {"bodies": {"free_rollers": True}, "load": {"axial": "12.5 kN"}, "solver": {"step_s": 1 / 81920}}


@pytest.mark.parametrize("name", ["rig", "rig-oil"])
def test_power_closes_and_the_loaded_row_carries(name: str) -> None:
    run = simulate(load_scene(name, AXIAL | {"duration": "0.1 s", "settle": "0.1 s"}), step=Step.UNCHECKED)
    assert run.status is RunStatus.OK
    assert abs(run.energy_imbalance) < CLOSED
    assert run.free_rollers["row_1_share"] == pytest.approx(SHARE, abs=SHARE_OFF)
    assert 0.1 < run.free_rollers["tilt_mrad"] < 1
    assert 10 < run.free_rollers["shift_um"] < 100
    assert run.free_rollers["skew_nm"] > 0
    assert not simulate(load_scene(name, {"duration": "1 ms", "settle": "0 s"}), step=Step.UNCHECKED).free_rollers


@pytest.mark.parametrize("model", ["full", "line", "planar"])
def test_other_models_refuse_them(model: str) -> None:
    with pytest.raises(ConfigurationError, match="holds its rollers"):
        simulate(load_scene("paper", {"model": model, "bodies": {"free_rollers": True}}))
