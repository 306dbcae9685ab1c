"""Which roller carries how much, how far the ring moves: slices against continuous integrals.

Reason: the distribution of load decides where rollers roll and how they strike a defect. Source: `slices_reference.py`,
integrals along the roller with SciPy's root finding, for radial, axial and combined load through the bearing alone.
Without friction, gravity, and at a shaft speed that presses no roller outwards.
"""

from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.harness import FloatArray, Parameters, Scene, geometry, layout_of, merged, paper_scene, rates
from tests.verification.slices_reference import STATIC, SlicedBearing, loads_of_slices, slices_model

CASES: dict[str, dict[str, Any]] = {
    "radial": {},
    "radial, profiles of one radius": {"line_contact": {"outer_osculation": 1.0, "inner_osculation": 1.0}},
    "axial": {"load": {"radial": "0 N", "axial": "40 kN"}},
    "radial and axial": {"load": {"axial": "30 kN"}},
    "radial and axial, races of different osculation": {
        "load": {"axial": "20 kN"},
        "line_contact": {"outer_osculation": 0.985, "inner_osculation": 0.96},
    },
    # the contacts' middles lie beyond the rollers' ends: the standard's 30 slices and more for that
    "play, radial and axial, edges": {
        "load": {"axial": "49 kN", "direction": "-75 deg"},
        "contact": {"radial_play": "0.1 mm"},
        "line_contact": {"slices": 41},
    },
}
ROLLER = 0.02  # of a roller's load: one at the end of the load zone is pressed over two or three slices
SHARES = 0.03  # of a row's share of the load, of slices at the edges of a contact
RING, RING_M = 2e-3, 1e-8  # of the displacement: a tenth of `ROLLER`, of all loads together
NOTICED = 0.01  # of the largest load


def case_of(name: str) -> tuple[Scene, Parameters]:
    scene = paper_scene(**merged(STATIC, CASES[name]))
    return scene, slices_model(scene)


def load_on_ring(scene: Scene) -> FloatArray:
    load = scene.load
    radial = load.radial_n * np.array([np.cos(load.direction_rad), np.sin(load.direction_rad)])
    return np.array([*radial, load.axial_n])


@pytest.mark.parametrize("name", CASES)
def test_loads_and_displacement_are_those_of_the_integral(name: str) -> None:
    scene, model = case_of(name)
    state = equilibrium_state(model)
    found = rates(model, 0.0, state).load_n.sum(axis=2)
    bearing = SlicedBearing.like(model, scene)
    ring, slide = bearing.balance(load_on_ring(scene))
    expected = bearing.contacts(slide, ring).force_n.sum(axis=2)
    least = NOTICED * float(expected.max())
    assert 5 <= (expected[0] > least).sum() < len(slide)
    assert found == pytest.approx(expected, rel=ROLLER, abs=ROLLER * least)
    rows = found.reshape(2, 2, -1).sum(axis=2)
    rows_expected = expected.reshape(2, 2, -1).sum(axis=2)
    whole = rows_expected.sum(axis=1, keepdims=True)
    assert rows / rows.sum(axis=1, keepdims=True) == pytest.approx(rows_expected / whole, rel=SHARES, abs=SHARES / 1e3)
    assert state[layout_of(state).ring] == pytest.approx(ring, rel=RING, abs=RING * np.abs(ring).max() + RING_M)


def pressed(osculation: float, slide_m: float, slices: int = 11) -> tuple[Parameters, FloatArray]:
    """A model and a state in which every roller is pressed into the outer race alone."""
    profiles = {"outer_osculation": osculation, "inner_osculation": osculation, "slices": slices}
    model = slices_model(paper_scene(**merged(STATIC, {"line_contact": profiles})))
    y = np.zeros_like(equilibrium_state(model))
    g = geometry()
    gap = g.raceway_radius_m - g.roller_centre_distance_m - model.law.roller_radius
    y[layout_of(y).slide] = gap + slide_m
    return model, y


@pytest.mark.parametrize("name", ["radial", "radial and axial"])
def test_load_along_the_roller(name: str) -> None:
    """The most loaded roller's slices carry what the integral has between their ends."""
    scene, model = case_of(name)
    state = equilibrium_state(model)
    bearing = SlicedBearing.like(model, scene)
    where = layout_of(state)
    found = loads_of_slices(model, state)
    whole = bearing.contacts(state[where.slide], state[where.ring]).force_n
    j = int(whole[0].sum(axis=1).argmax())
    for race in (0, 1):
        places = np.arange(whole.shape[2] + 1) / whole.shape[2] * geometry().roller_width_m
        running = np.concatenate([[0.0], np.cumsum(whole[race, j])])
        edges = np.concatenate([[0.0], np.cumsum(model.slices.rows[race, 0, col.SLICE_WIDTH])])
        expected = np.diff(np.interp(edges, places, running))
        assert found[race, j] == pytest.approx(expected, abs=ROLLER * expected.max())
