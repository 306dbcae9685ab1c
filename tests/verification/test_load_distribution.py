"""The static start, which spreads the load over the rollers, is in balance by the second formulation.

Reason: the load per roller decides penetrations, friction and the height of every impact. Source: forces of every point
of `world.py` on every roller and on the ring, without friction or smoothing, at a shaft speed that presses no roller
outwards; the balance has one solution.
"""

from typing import Any

import pytest

from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.harness import geometry, layout_of, merged, paper_scene, parameters
from tests.verification.world import World

BALANCED_N = 1.0  # of 124.8 kN
STATIC = {
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0, "smoothing_width": "1e-13 m"},
    "shaft_speed": "1e-6 rpm",
}
CASES: dict[str, dict[str, Any]] = {
    "housing carries its part": {},
    "printed diameter": {"contact": {"roller_fit": "printed"}},
    "through the bearing alone": {"load": {"path": "bearing"}},
    "radial and axial, printed diameter": {
        "contact": {"roller_fit": "printed"},
        "load": {"axial": "49 kN", "path": "bearing", "direction": "-75 deg"},
    },
}


@pytest.mark.parametrize("name", CASES)
def test_the_start_is_balanced_by_the_second_formulation(name: str) -> None:
    scene = paper_scene(**merged(STATIC, CASES[name]))
    model, world = parameters(scene), World(scene, geometry())
    y = equilibrium_state(model)
    found = world.contacts(0.0, y)
    assert (found.force * world.slots(y)[:, :, 0]).sum(axis=1) == pytest.approx(0.0, abs=BALANCED_N)
    left = world.external_load(0.0) + found.on_ring - world.housing_stiffness() * y[layout_of(y).ring]
    assert left == pytest.approx(0.0, abs=BALANCED_N)
    assert 5 <= (found.load[0].sum(axis=1) > BALANCED_N).sum() <= layout_of(y).rollers
