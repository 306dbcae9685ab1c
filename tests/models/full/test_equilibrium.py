"""The static start: rolling rollers, settled from the first sample, impossible loads refused.

Its balance is checked in `tests/verification/test_load_distribution.py`.
"""

from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError, paper_scene
from srbval.models.full.equilibrium import balance_friction, equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import take_steps
from srbval.models.solvers import METHODS
from tests.verification.harness import parameters, rolling_state

ROLLING_M_S = 1e-12  # rounding of some metres per second
BAND = 0.05  # of the range of the later values, which the first ones may exceed


def model_of(**changes: Any) -> Parameters:
    return parameters(paper_scene(**changes))


def test_rollers_that_touch_nothing_roll():
    """Without traction cage and rollers have the speeds of pure rolling, the outer contact at rest."""
    model = model_of(contact={"radial_play": "3 mm"})
    state = balance_friction(model, np.zeros_like(rolling_state(model)))
    n, half = len(model.slot_angle), len(state) // 2
    cage = state[half + 2 * n + 2]
    assert cage == rolling_state(model)[half + 2 * n + 2]
    centre_speed = cage * model.centre_distance * model.tilt_cosine
    assert centre_speed + state[half + n : half + 2 * n] * model.law.roller_radius == pytest.approx(
        0.0, abs=ROLLING_M_S
    )


def settled(model: Parameters, start: np.ndarray, seconds: float) -> np.ndarray:
    """Ring displacement along y and cage speed over shaft speed, one row per output interval."""
    steps = take_steps(
        model,
        start.copy(),
        METHODS["imex2"],
        step_s=1 / 61440,
        intervals=range(round(seconds * 20480)),
        steps_per_output=3,
    )
    return np.stack([steps.out[:, 4], steps.out[:, 6] / model.drive.speed[1, 0]], axis=1)


@pytest.mark.parametrize("fit", ["play", "printed"])
def test_a_run_is_settled_from_its_first_sample(fit):
    """From here ring and cage stay within the band of their later values; from mere rolling they do not."""
    model = model_of(contact={"roller_fit": fit}, defect={"kind": "outer"})
    run = settled(model, equilibrium_state(model), 0.5)
    low, high = run[1024:].min(axis=0), run[1024:].max(axis=0)
    widened = BAND * (high - low)
    assert np.all((run[:1024] > low - widened) & (run[:1024] < high + widened))
    rolling = settled(model, rolling_state(model), 0.01)
    assert not np.all((rolling > low - widened) & (rolling < high + widened))


@pytest.mark.parametrize(
    ("load", "contact"),
    [
        ({"path": "bearing", "radial": "5 MN"}, {}),
        ({"path": "bearing", "axial": "2 MN"}, {}),
        ({}, {"radial_play": "-0.39 mm"}),
    ],
)
def test_a_crushed_contact_is_refused(load, contact):
    with pytest.raises(ConfigurationError, match=r"overload the contact.* um; .*limit is 200 um"):
        equilibrium_state(model_of(load=load, contact=contact))
