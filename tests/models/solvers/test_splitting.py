"""A run taken in pieces is the run taken at once, to the last bit: nothing but state and memory is handed on."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.steps import rates, take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene

STEP_S = 1 / 61440
PER_OUTPUT = 2


def make_model() -> Parameters:
    """A damaged roller, whose contacts know its angle about its axis, in working space of its own."""
    geometry = load_bearing("skf-22240").geometry
    assert geometry is not None
    defect = {"kind": "roller", "extent": "6 mm", "height": "0.04 mm", "shape": "cosine"}
    return make_parameters(paper_scene(contact={"roller_fit": "printed"}, defect=defect), geometry)


@pytest.mark.parametrize("per_detail", [0, 3])
@pytest.mark.parametrize("name", METHODS)
def test_pieces_are_bit_identical(name: str, per_detail: int) -> None:
    """Also where details are read in between, and where another model's working space takes over."""
    model = make_model()
    start = equilibrium_state(model)
    method, whole, pieces, memory = METHODS[name], start.copy(), start.copy(), np.zeros_like(start)
    at_once = take_steps(model, whole, method, step_s=STEP_S, intervals=14, steps_per_output=PER_OUTPUT).out
    found = []
    for first, count in ((0, 6), (6, 3), (9, 5)):
        fresh = make_model()
        rates(fresh, 0.0, start)
        steps = take_steps(
            fresh, pieces, method, step_s=STEP_S, intervals=count, steps_per_output=PER_OUTPUT, first_interval=first,
            intervals_per_detail=per_detail, memory=memory,
        )  # fmt: skip
        found.append(steps.out)
    assert np.array_equal(np.concatenate(found), at_once)
    assert np.array_equal(pieces, whole)


def test_without_its_memory_a_leapfrog_goes_on_otherwise() -> None:
    """So the memory that the checks above hand on is of consequence."""
    model = make_model()
    whole = equilibrium_state(model)
    pieces = whole.copy()
    take_steps(model, whole, METHODS["imex2"], step_s=STEP_S, intervals=2)
    for first in (0, 1):
        take_steps(model, pieces, METHODS["imex2"], step_s=STEP_S, intervals=1, first_interval=first)
    assert not np.array_equal(pieces, whole)
