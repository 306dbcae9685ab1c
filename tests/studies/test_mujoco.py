"""The scene in MuJoCo carries its load as srbval's does."""

import sys

import numpy as np
import pytest

from srbval.scene import paper_scene
from srbval.storage.installation import MissingLibraryError
from srbval.studies.mujoco.study import STEP_S, MujocoRun

CLOSE = 0.03  # of the ring's displacement, which moves by 2 %; a contact twice as stiff would be 6 % away
SLIP = 0.001  # of the cage ratio in 20 ms, in which the outer race is passed once and a half


def test_ring_and_cage_stay_where_the_static_balance_puts_them() -> None:
    engine = MujocoRun(paper_scene(defect={"kind": "outer"}, solver={"step_s": STEP_S}))
    assert engine.model.nv == 83
    balance_m, found_m, begun_rad = engine.data.qpos[1], [], engine.cage_rad
    for _ in range(20):
        engine.advance(0.001)
        found_m.append(engine.data.qpos[1])
    assert np.mean(found_m[5:]) == pytest.approx(balance_m, rel=CLOSE)
    turned_rad = engine.data.qpos[3]
    assert (engine.cage_rad - begun_rad) / turned_rad == pytest.approx(0.4315, abs=SLIP)


def test_without_mujoco_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingLibraryError, match=r"needs mujoco, not installed: .*pip install"):
        MujocoRun(paper_scene())
