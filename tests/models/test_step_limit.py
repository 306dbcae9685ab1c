"""The step limit told before a run: one roller stands for the whole bearing."""

import pytest

from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full_run import elastic_limit_s, stiffest_roller, without_friction
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene
from tests.verification.harness import parameters

EULER = 1e-4  # of c / k, which holds where an oscillation is damped far below critical


@pytest.mark.parametrize("speed", ["127 rpm", "3000 rpm"])
def test_the_limit_is_that_at_rest(speed: str) -> None:
    """A turning shaft drives points past rollers that they just touch; that is no stiffness."""
    model = parameters(paper_scene(shaft_speed=speed))
    found = elastic_limit_s(METHODS["imex2"], model, equilibrium_state(model))
    assert 4 < found * 61440 < 5


def test_euler_needs_a_step_below_damping_over_stiffness() -> None:
    """The explicit Euler method damps an oscillator only up to c / k (Hairer & Wanner 1996, sect. IV.2)."""
    model = parameters(paper_scene())
    state = equilibrium_state(model)
    roller = stiffest_roller(without_friction(model), state)
    expected = roller.damping[0, 0] / roller.stiffness[0, 0]
    assert elastic_limit_s(METHODS["ode1"], model, state) == pytest.approx(expected, rel=EULER)
