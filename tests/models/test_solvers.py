"""Methods: their coefficients on equations with a closed form, and runs taken in pieces.

Orders on the contact problem are tested in `tests/verification/test_convergence_order.py`.
"""

import numpy as np
import pytest

from srbval.errors import UnknownNameError
from srbval.models import jit
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import rates, take_steps
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import LEAPFROG, METHODS
from srbval.scene import paper_scene
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, parameters

EXACT = 1e-15  # of sums of a few fractions below one
STIFF, LEFT = -1e9, 1e-8  # R(z) falls as 1/z for an L-stable method: some of 1e-9 is left
ROUNDING = 1e-12  # of |R| on the imaginary axis, where it is 1 for methods that do not damp
PER_OUTPUT = 2


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if not method.implicit])
def test_order_conditions(name: str) -> None:
    """Hairer, Norsett & Wanner I, sect. II.2: one equation per rooted tree up to order 4."""
    t = METHODS[name].coefficients
    a, b, c = t.a, t.b, t.c
    conditions = [
        [(b.sum(), 1)],
        [(b @ c, 1 / 2)],
        [(b @ c**2, 1 / 3), (b @ a @ c, 1 / 6)],
        [(b @ c**3, 1 / 4), (b @ (c * (a @ c)), 1 / 8), (b @ a @ c**2, 1 / 12), (b @ a @ a @ c, 1 / 24)],
    ]
    for order, equations in enumerate(conditions, start=1):
        met = all(np.isclose(found, wanted, atol=EXACT) for found, wanted in equations)
        assert met == (order <= METHODS[name].order), f"order {order}"


def growth(name: str, z: complex) -> complex:
    """x(h) / x(0) of x' = J x, z = h J, by the stages as the method's coefficients give them."""
    m = METHODS[name].coefficients
    s = 1 / (1 - m.implicit_coefficient * z)
    if m.family == LEAPFROG:
        k1 = s * z
        k2 = s * (z * (1 + k1) - 2 * k1)
        return 1 + sum(b * k for b, k in zip(m.b, (k1, k2), strict=False))
    u: list[complex] = []
    for stage in range(len(m.b)):
        state = 1 + sum(m.a[stage, p] * u[p] for p in range(stage))
        u.append(m.implicit_coefficient * s * (z * state + sum(m.g[stage, p] * u[p] for p in range(stage))))
    return 1 + sum(b * value for b, value in zip(m.b, u, strict=True))


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if method.implicit])
def test_stiff_components_die_within_a_step(name: str) -> None:
    assert abs(growth(name, STIFF)) < LEFT
    ray = -np.logspace(-3, 6, 200)
    assert np.all(np.abs([growth(name, z) for z in ray]) < 1)
    assert np.all(np.abs([growth(name, 1j * z) for z in ray]) <= 1 + ROUNDING), "A-stable: the imaginary axis"


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
            fresh, pieces, method, step_s=PAPER_STEP_S, intervals=range(first, first + count),
            steps_per_output=PER_OUTPUT, intervals_per_detail=3, memory=memory,
        )  # fmt: skip
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
