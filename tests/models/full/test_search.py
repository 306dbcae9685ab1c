"""Fewer columns and fewer points looked at: nothing that touches may be missed."""

from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.columns import layout_of
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.verification.harness import parameters

STEP_S = 1 / 61440
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
    """The same model with the widest windows for every roller within reach, and damage all round the damaged ones."""
    raised, sunk = model.roller_defects.copy(), model.roller_defects.copy()  # by the same height
    raised[:, col.DEFECT_EXTENT] = sunk[:, col.DEFECT_EXTENT] = 1.0
    sunk[:, col.DEFECT_HEIGHT] *= -1.0
    return model._replace(
        roller_defects=np.concatenate([model.roller_defects, raised, sunk]),
        races=model.races._replace(
            outer=model.races.outer._replace(clearance=NO_CLEARANCE_M),
            inner=model.races.inner._replace(clearance=NO_CLEARANCE_M),
        ),
    )


def shaken(model: Parameters, seed: int) -> np.ndarray:
    """A state about balance: rollers up to 60 um off, ring 40 um, cage tilted by up to 2 mrad, all moving."""
    rng = np.random.default_rng(seed)
    y = equilibrium_state(model).copy()
    layout = layout_of(y)
    n, cage, cage_rate = layout.rollers, layout.cage.start, layout.cage_rate.start
    y[layout.slide] += rng.uniform(-6e-5, 6e-5, n)
    y[layout.rotation] = rng.uniform(-3, 3, n)
    y[cage : cage + 2] += rng.uniform(-2e-3, 2e-3, 2)
    y[cage + 2] = rng.uniform(-3, 3)
    y[layout.ring] += rng.uniform(-4e-5, 4e-5, 3)
    y[layout.slide_rate] += rng.normal(0, 0.03, n)
    y[layout.shaft_cage_rate] *= rng.choice([1.0, -1.0, 4.0])  # rollers pass the races' points either way
    y[cage_rate : cage_rate + 2] += rng.normal(0, 0.05, 2)
    y[layout.ring_rate] += rng.normal(0, 0.02, 3)
    return y


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("solver", ["imex2", "ros2"])
def test_nothing_that_begins_to_touch_is_missed(scene: str, solver: str) -> None:
    """Implicit methods let an approaching point act a little before it touches."""
    model = parameters(paper_scene(**SCENES[scene]))
    everything = looking_at_all(model)
    for seed in range(10):
        few, all_ = shaken(model, seed), shaken(model, seed)
        for m, y in ((model, few), (everything, all_)):
            take_steps(m, y, METHODS[solver], step_s=STEP_S, intervals=range(100 * seed, 100 * seed + 2))
        scale = np.abs(all_[layout_of(all_).half :]).max()
        assert few == pytest.approx(all_, rel=SAME_STEPS, abs=SAME_STEPS_SHARE * scale)
