"""No part of a scene is held by a force that its description does not name.

Reason: a damper that is left over where a spring was taken away takes energy from nothing that was stated, and hides
resonances: 5e5 Ns/m were 0.40 of critical on the ring of the scene `rig`. Source: what is described, written out here:
the paper's Table 4 for the load path `housing`, nothing for `bearing` but what the scene `rig` states of its box's
joints.
"""

from typing import Any

import pytest

from srbval import load_bearing, load_scene
from srbval.models.planar.ring import make_ring
from tests.verification.harness import parameters

TABLE_4, NOTHING = (5e9, 5e5), (0.0, 0.0)  # N/m, Ns/m
PATH: dict[str, Any] = {"load": {"path": "bearing"}}
DESCRIBED: dict[str, tuple[str, dict[str, Any], tuple[float, float]]] = {
    "paper": ("paper", {}, TABLE_4),
    "paper, continuous": ("paper", {"model": "line"}, TABLE_4),
    "paper, load on the rollers": ("paper", PATH, NOTHING),
    "paper, load on the rollers, stated damper": ("paper", PATH | {"housing": {"damping": "2e3 Ns/m"}}, (0.0, 2e3)),
    "rig": ("rig", {}, (0.0, 3.1e4)),
    "rig, its points": ("rig", {"model": "full"}, (0.0, 3.1e4)),
    "rig without joints": ("rig", {"housing": {"damping": "0 Ns/m"}}, NOTHING),
}


@pytest.mark.parametrize("name", DESCRIBED)
def test_what_holds_the_ring(name):
    """In every model what is described, and no more; the equations of motion have nothing else that holds it."""
    base, changes, described = DESCRIBED[name]
    scene, bearing = load_scene(base, changes), load_bearing("skf-22240")
    model = parameters(scene)
    assert (model.housing_stiffness, model.housing_damping) == described
    kernel = make_ring(scene, bearing).kernel
    assert (kernel.stiffness, kernel.damping) == described
