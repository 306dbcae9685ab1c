"""Runs taken in pieces, and solvers that are not known; orders: `tests/verification/test_convergence_order.py`."""

import numpy as np
import pytest

from srbval.errors import UnknownNameError
from srbval.models import jit
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import rates, take_steps
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, parameters

PER_OUTPUT = 2


def damaged() -> Parameters:
    """A damaged roller, whose contacts know its angle about its axis, in working space of its own."""
    defect = {"kind": "roller", "extent": "6 mm", "height": "0.04 mm", "shape": "cosine"}
    return parameters(paper_scene(contact=PRINTED_FIT, defect=defect))


@pytest.mark.parametrize("name", METHODS)
def test_a_run_in_pieces_is_bit_identical(name: str) -> None:
    """Also where details are read in between, and where another model's working space takes over."""
    model = damaged()
    start = equilibrium_state(model)
    method, whole, pieces, memory = METHODS[name], start.copy(), start.copy(), np.zeros_like(start)
    at_once = take_steps(
        model, whole, method, step_s=PAPER_STEP_S, intervals=range(14), steps_per_output=PER_OUTPUT
    ).out
    found = []
    for first, count in ((0, 6), (6, 3), (9, 5)):
        fresh = damaged()
        rates(fresh, 0.0, start)
        steps = take_steps(
            fresh,
            pieces,
            method,
            step_s=PAPER_STEP_S,
            intervals=range(first, first + count),
            steps_per_output=PER_OUTPUT,
            intervals_per_detail=3,
            memory=memory,
        )
        found.append(steps.out)
    assert np.array_equal(np.concatenate(found), at_once)
    assert np.array_equal(pieces, whole)
    without = start.copy()
    for first in range(2):
        take_steps(model, without, method, step_s=PAPER_STEP_S, intervals=range(first, first + 1))
    take_steps(model, whole := start.copy(), method, step_s=PAPER_STEP_S, intervals=range(2))
    assert np.array_equal(without, whole) == (not method.coefficients.ahead), "the memory is of consequence"


@pytest.mark.parametrize("step", [Step.CHECKED, Step.UNCHECKED])
@pytest.mark.parametrize("name", ["imex3", "a" * 5000], ids=["misspelt", "longer than a file's name may be"])
def test_an_unknown_solver_is_refused_before_anything_is_compiled(
    name: str, step: Step, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "_missing", lambda _: pytest.fail("kernels are looked for"))
    with pytest.raises(UnknownNameError, match="is not known"):
        simulate(paper_scene(solver={"name": name}), step=step)
