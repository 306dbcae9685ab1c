"""The static start, which spreads the load over the rollers, is in balance by the second formulation.

Reason: the load per roller decides penetrations, friction and the height of every impact. Source: forces of every point
of `world.py` on every roller and on the ring, without friction or smoothing, at a shaft speed that presses no roller
outwards; the balance has one solution.
"""

from typing import Any

import pytest

from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.cases import subject
from tests.verification.harness import layout_of, merged

BALANCED_N = 1.0  # of 124.8 kN
STATIC = {
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0, "smoothing_width": "1e-13 m"},
    "shaft_speed": "1e-6 rpm",
}
UNLOADED = ("no load", "play 0.2 mm")  # the housing carries all before the ring reaches a roller
CAGE_ANGLES = (0.0, 0.09)  # at 0.09 rad a roller of row 1 stands in the middle of the load zone, on a defect
PRINTED, LOOSE = {"contact": {"roller_fit": "printed"}}, {"contact": {"radial_play": "0.2 mm"}}
ALONE, AXIAL = {"load": {"path": "bearing"}}, {"load": {"axial": "49 kN"}}
CASES: dict[str, dict[str, Any]] = {
    "housing carries its part": {},
    "printed diameter": PRINTED,
    "play 0.2 mm": LOOSE,
    "no load": {"load": {"radial": "0 N"}},
    "axial": AXIAL,
    "through the bearing alone": ALONE,
    "through the bearing alone, play, axial": merged(ALONE, LOOSE, AXIAL),
    "radial and axial, printed diameter": merged(ALONE, PRINTED, AXIAL, {"load": {"direction": "-75 deg"}}),
    "bump outside": {"defect": {"kind": "outer"}},
    "bump inside": merged(ALONE, {"defect": {"kind": "inner"}}),
    "pit inside": {"defect": {"kind": "inner", "height": "-0.2 mm"}},
    "bump on a roller": {"defect": {"kind": "roller", "extent": "2 mm", "angle": "0 deg"}},
    "fine": merged(ALONE, LOOSE, {"contact": {"points_per_circle": 4000}}),
}


@pytest.mark.parametrize("cage_angle", CAGE_ANGLES)
@pytest.mark.parametrize("name", CASES)
def test_the_start_is_balanced_by_the_second_formulation(name, cage_angle):
    model, world = subject(STATIC, CASES[name])
    y = equilibrium_state(model, cage_angle_rad=cage_angle)
    found = world.contacts(0.0, y)
    assert (found.force * world.slots(y)[:, :, 0]).sum(axis=1) == pytest.approx(0.0, abs=BALANCED_N)
    left = world.external_load(0.0) + found.on_ring - world.housing_stiffness() * y[layout_of(y).ring]
    assert left == pytest.approx(0.0, abs=BALANCED_N)
    assert name in UNLOADED or 5 <= (found.load[0].sum(axis=1) > BALANCED_N).sum() <= layout_of(y).rollers
