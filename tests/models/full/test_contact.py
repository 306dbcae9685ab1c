"""Static start, and points that come into contact within a step; balance and contact law: `tests/verification`."""

from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.columns import layout_of
from srbval.models.full.contact_kernel import ContactLaw, contact_columns
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.motion_kernel import WITH_DAMPING
from srbval.models.full.parameters import Parameters
from srbval.models.outputs import CAGE_SPEED, DISPLACEMENT_Y
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.verification.cases import disturbed
from tests.verification.harness import PAPER_STEP_S, advance, full_run, parameters, rolling_state

BAND = 0.05  # of the range of the later values, which the first ones may exceed
CRUSHED = [{"load": {"path": "bearing", way: force}} for way, force in (("radial", "5 MN"), ("axial", "2 MN"))]


def model_of(**changes: Any) -> Parameters:
    return parameters(paper_scene(**changes))


def settled(model: Parameters, start: np.ndarray, seconds: float) -> np.ndarray:
    """Simulate; returns ring displacement along y and cage speed over shaft speed, one row per output interval."""
    outputs = round(seconds / PAPER_STEP_S / 3)
    out = advance(model, start.copy(), step_s=PAPER_STEP_S, steps=3, method="imex2", outputs=outputs)
    return np.stack([out[:, DISPLACEMENT_Y], out[:, CAGE_SPEED] / model.drive.speed[1, 0]], axis=1)


@pytest.mark.parametrize("fit", ["play", "printed"])
def test_a_run_is_settled_from_its_first_sample(fit):
    """Ring and cage stay within the band of their later values; a start from mere rolling does not."""
    model = model_of(contact={"roller_fit": fit}, defect={"kind": "outer"})
    run = settled(model, equilibrium_state(model), 0.5)
    low, high = run[1024:].min(axis=0), run[1024:].max(axis=0)
    widened = BAND * (high - low)
    assert np.all((run[:1024] > low - widened) & (run[:1024] < high + widened))
    rolling = settled(model, rolling_state(model), 0.01)
    assert not np.all((rolling > low - widened) & (rolling < high + widened))


@pytest.mark.parametrize("changes", [*CRUSHED, {"contact": {"radial_play": "-0.39 mm"}}])
def test_a_crushed_contact_is_refused(changes):
    with pytest.raises(ConfigurationError, match=r"overload the contact.* um; .*limit is 200 um"):
        equilibrium_state(model_of(**changes))


R, PROFILE = 0.020, 0.164
K, C, W, MU_S, MU_D, V_C = 5e7, 1e3, 1e-8, 0.7, 0.5, 1e-3
MEAN, MEAN_N = 2e-3, 1e-9  # of a force averaged over 20 000 moments, one of which sees the contact begin


@pytest.mark.parametrize("share", [-0.6, -0.45, -0.2, 0.0, 0.3, 0.5, 2.0])
def test_coming_into_contact_is_averaged_over_its_time(share):
    """Spring and damper equal their mean over the averaging time, at a moment when the point is `share` of it inside.

    Work against the approach, beyond the energy of a spring as deep as the point, is lost.
    """
    onset, rate, column = 1.5e-5, 0.6, 3
    depth = share * rate * onset
    points = np.zeros((1, 1, col.POINT_ROWS, 1))
    points[0, 0, [col.POINT_RADIAL, col.POINT_SHARE], 0] = R - depth, 1.0
    space = np.zeros((col.WORKSPACE_ROWS, col.STRIDE))
    a_x, b_y, z_z, o_x, v_x = (int(row) // col.STRIDE for row in (col.A_X, col.B_Y, col.Z_Z, col.O_X, col.V_X))
    others = np.delete(np.arange(col.LANES), column)
    space[[a_x, b_y, z_z], column], space[v_x, column], space[o_x, others] = 1.0, -rate, col.FAR_M
    law = ContactLaw(PROFILE, R, K, C, W, MU_S, MU_D, V_C, onset)
    contact_columns(law, points, 0, 0, 0, 1, space.ravel(), 0, col.LANES, WITH_DAMPING, None)
    sums = space[col.FIRST_SUM : col.LAST_SUM]
    assert not sums[:, others].any(), "columns do not mix"
    f_x, *_, lost, _ = sums[:, column]
    then = depth + rate * onset * (np.arange(20_000) + 0.5 - 10_000) / 20_000
    expected = np.where(then > 0, K * then + C * rate, 0.0).mean()
    assert -f_x == pytest.approx(expected, rel=MEAN, abs=MEAN_N)
    assert lost == pytest.approx((expected - K * max(depth, 0.0)) * rate, rel=MEAN, abs=MEAN_N)


NO_CLEARANCE_M = 1e-30  # so that every roller within reach is given the widest window
SAME_STEPS, SAME_STEPS_SHARE = 1e-8, 1e-11  # the same after two steps; of the largest velocity
DAMAGE = {"kind": "roller", "height": "0.05 mm", "extent": "8 mm"}
SCENES: dict[str, dict[str, Any]] = {
    "play 0, outer": {"defect": {"kind": "outer"}},
    "interference, inner": {"defect": {"kind": "inner"}, "contact": {"roller_fit": "printed"}},
    "dense": {"contact": {"points_per_circle": 3000, "stiffness": "5e6 N/m"}},
    "roller": {"defect": DAMAGE, "further_defects": [DAMAGE | {"roller": roller} for roller in range(2, 20)]},
}


def looking_at_all(model: Parameters) -> Parameters:
    """Give the model the widest windows for all rollers within reach, and damaged rollers damage all round."""
    raised, sunk = model.roller_defects.copy(), model.roller_defects.copy()  # by the same height
    raised[:, col.DEFECT_EXTENT] = sunk[:, col.DEFECT_EXTENT] = 1.0
    sunk[:, col.DEFECT_HEIGHT] *= -1.0
    wide = {"per_clearance": 1 / NO_CLEARANCE_M}
    races = model.races._replace(outer=model.races.outer._replace(**wide), inner=model.races.inner._replace(**wide))
    return model._replace(roller_defects=np.concatenate([model.roller_defects, raised, sunk]), races=races)


def shaken(balanced: np.ndarray, seed: int) -> np.ndarray:
    """Disturb a balanced state; rollers pass the races' points either way."""
    y = disturbed(balanced, seed, cage_angle=float(seed), tilt_rad=1e-3, off_m=5e-5)
    y[layout_of(y).shaft_cage_rate] *= (1.0, -1.0, 4.0)[seed % 3]
    return y


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_that_begins_to_touch_is_missed(scene):
    """With implicit methods an approaching point acts a little before it touches."""
    model = parameters(paper_scene(**SCENES[scene]))
    everything, balanced = looking_at_all(model), equilibrium_state(model)
    for seed in range(10):
        few, all_ = shaken(balanced, seed), shaken(balanced, seed)
        for m, y in ((model, few), (everything, all_)):
            full_run(m, y, METHODS["imex2"], PAPER_STEP_S).advance(100 * seed, 2)
        scale = np.abs(all_[layout_of(all_).half :]).max()
        assert few == pytest.approx(all_, rel=SAME_STEPS, abs=SAME_STEPS_SHARE * scale)
