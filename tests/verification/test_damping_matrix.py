"""The damping matrix of the implicit methods, found by solving their arrow-shaped equations, against a dense one.

Reason: an implicit method keeps its order whatever stands for the Jacobian, so a wrong damping matrix shows in no
convergence test, only as chatter or drag at coarse steps. Sources: G' C G summed over the points that touch
(`matrices.py`); `numpy.linalg.solve`; difference quotients of the model's own accelerations.

The kernels' parts are called from Python, where nothing is compiled: the short form runs this file beside the planted
errors alone.
"""

import numpy as np
import pytest

from tests.verification.cases import TWO_CAGES, make_case, subject
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, implicit_response, layout_of, rates, rolling_state
from tests.verification.matrices import damping_with_shaft, mass_matrix

SCENES = (
    "play, paper's case",
    "interference, damaged roller",
    "every force at once, changing speed and load",
    TWO_CAGES,
)
# In units in which every mass is one. Masses by slices are good to 7e-11, and a solution with them follows.
MATRIX = 1e-9
SYMMETRY = 1e-10  # the response is inverted in double precision
QUOTIENT = 1e-9  # forces are linear in these speeds: rounding of the quotient
SPEED = 1e-4  # of bodies of 1 kg [m/s], so that every slip is far below the 10 m/s at which friction's slope ends
DIRECTIONS = 4


pytestmark = pytest.mark.long_form


@pytest.fixture(params=SCENES, scope="module")
def case(request):
    return make_case(request.param)


def test_damping_matrix(case):
    """Recovered from the response S to accelerations: D = M (S^-1 - 1) / h; symmetric, never driving."""
    mass, respond = mass_matrix(case.world, case.y), implicit_response(case.model, case.time, case.y, PAPER_STEP_S)
    response, root = np.array([respond(unit) for unit in np.eye(len(mass))]).T, np.sqrt(np.diag(mass))
    units = np.outer(root, root)
    expected = damping_with_shaft(case.world, case.time, case.y)[:-1, :-1] / units
    found = (np.linalg.solve(response.T, mass).T - mass) / PAPER_STEP_S / units
    largest = np.abs(expected).max()
    assert largest > 1e5, "in 1/s: contacts must rub"
    assert found == pytest.approx(expected, abs=MATRIX * largest)
    assert found == pytest.approx(found.T, abs=SYMMETRY * largest)
    assert np.linalg.eigvalsh((found + found.T) / 2)[0] > -SYMMETRY * largest


def test_damping_matrix_is_the_jacobian_at_rest():
    """Nothing moves, so friction sticks and no damper acts on it; the turning about the slots is all that is left out.

    Between pure sticking and sliding the secant stands for the slope on purpose, which no difference quotient shows.
    """
    contact = PRINTED_FIT | {"critical_velocity": "10 m/s"}
    model, world = subject({"contact": contact, "shaft_speed": "1e-9 rpm"})
    y = rolling_state(model)
    where = layout_of(y)
    y[where.ring] += (1e-6, 2e-6, -3e-6)
    y[where.cage] = (2e-4, -1e-4, 0.3)
    y[where.half :] = 0.0
    mass = mass_matrix(world, y)
    jacobian = -np.linalg.solve(mass, damping_with_shaft(world, 0.0, y, about_slot=True)[:-1, :-1])
    rng = np.random.default_rng(6)
    for _ in range(DIRECTIONS):
        speeds = rng.normal(size=where.half) / np.sqrt(np.diag(mass))
        step = np.concatenate([np.zeros(where.half), SPEED * speeds])
        slope = (rates(model, 0.0, y + step).rate - rates(model, 0.0, y - step).rate)[where.half :] / (2 * SPEED)
        for part in where.parts[:4]:
            expected = (jacobian @ speeds)[part]
            assert slope[part] == pytest.approx(expected, abs=QUOTIENT * np.abs(expected).max())
