"""No part of a scene is held by a force that its description does not name.

Reason: a damper that is left over where a spring was taken away takes energy from nothing that was stated, and hides
resonances: 5e5 Ns/m were 0.40 of critical on the ring of the scene `rig`. Source: Newton's second law for the ring:
what moves it, less the rollers' forces (their balances are tested elsewhere), load and weight, is the housing's. What
is described is written out here: the paper's Table 4 for the load path `housing`, nothing for `bearing` but what the
scene `rig` states of its box's joints.
"""

from typing import Any

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.state import layout_of
from srbval.models.hierarchy import level_of
from srbval.models.planar.ring import make_ring
from srbval.models.precompile import load_kernels
from srbval.scene import load_scene
from srbval.studies.open_inputs import drawn, open_inputs
from tests.verification.harness import rates

TABLE_4, NOTHING = (5e9, 5e5), (0.0, 0.0)  # N/m, Ns/m
PATH: dict[str, Any] = {"load": {"path": "bearing"}}
DESCRIBED: dict[str, tuple[str, dict[str, Any], tuple[float, float]]] = {
    "paper": ("paper", {}, TABLE_4),
    "paper, continuous": ("paper", {"model": "line"}, TABLE_4),
    "paper, load on the rollers": ("paper", PATH, NOTHING),
    "rig": ("rig", {}, (0.0, 3.1e4)),
    "rig, its points": ("rig", {"model": "full"}, (0.0, 3.1e4)),
    "rig without joints": ("rig", {"housing": {"damping": "0 Ns/m"}}, NOTHING),
}
MOVED_M, MOVED_M_S = (3e-6, -2e-6, 4e-6), (0.011, 0.023, -0.017)
ROUNDING_N = 1e-4  # of forces of 1e5 N, in the ring's acceleration times its mass


@pytest.mark.parametrize("name", DESCRIBED)
def test_what_holds_the_ring(name: str) -> None:
    """The ring moved off its balance: beside its rollers, load and weight it feels what is described, and no more."""
    base, changes, (spring, damper) = DESCRIBED[name]
    scene = load_scene(base, changes)
    load_kernels([scene])
    geometry = load_bearing(scene.bearing).geometry
    model = level_of(scene.model).make_parameters(scene, geometry)
    y = equilibrium_state(model)
    where = layout_of(y)
    y[where.ring] += MOVED_M
    y[where.ring_rate] = MOVED_M_S
    found = rates(model, 0.0, y)
    mass = geometry.outer_ring_mass_kg(scene.bodies.density_kg_m3) + scene.housing.mass_kg
    weight = 9.80665 * mass if scene.load.gravity else 0.0
    named = found.totals[[col.RING_FORCE_X, col.RING_FORCE_Y, col.RING_FORCE_Z]] - (
        0.0,
        scene.load.radial_n + weight,
        0.0,
    )
    held = named - mass * found.rate[where.ring_rate]
    np.testing.assert_allclose(held, spring * y[where.ring] + damper * y[where.ring_rate], atol=ROUNDING_N)


@pytest.mark.parametrize("name", ["paper", "paper, load on the rollers", "rig"])
def test_the_planar_ring_is_held_alike(name: str) -> None:
    base, changes, described = DESCRIBED[name]
    kernel = make_ring(load_scene(base, changes), load_bearing("skf-22240")).kernel
    assert (kernel.stiffness, kernel.damping) == described


def test_the_damper_goes_with_the_spring_however_the_path_is_chosen() -> None:
    """By a scene file, or by an input of a study; a scene that states a damper has it."""
    path = next(one for one in open_inputs() if one.keys == ("load.path",))
    chosen = {drawn([path], load_scene("paper"), [share])[0] for share in (0.1, 0.9)}
    assert chosen == {load_scene("paper"), load_scene("paper", PATH)}
    stated = load_scene("paper", PATH | {"housing": {"damping": "2e3 Ns/m"}})
    assert stated.housing.damping_ns_m == 2e3
