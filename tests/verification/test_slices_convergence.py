"""Slices converge: the cage's speed with their number, motion with the step.

Reason: the default number and step are the coarsest that suffice, which only finer ones can show. The number's order is
read from the cage speed of runs; the line that stands for the gap over a slice is off by the square of its width. At
running speed, with rollers that enter and leave the load zone and one that crosses a hole, forces and their first
derivatives are continuous, so the methods of order one and two keep their orders. That is more than points allow.
"""

import numpy as np
import pytest

from srbval.models.full.equilibrium import equilibrium_state
from tests.verification.harness import merged, paper_scene, recorded
from tests.verification.slices_reference import slices_model
from tests.verification.test_convergence_order import errors
from tests.verification.test_slices_energy import CASES, OVER_RAD, RUN_STEP_S, SETTLING_STEPS
from tests.verification.test_slices_energy import RIG as MOVING
from tests.verification.test_slices_rolling import RIG, RUNS, ratio_of_run

NUMBERS, FINEST = (5, 9, 15, 21, 31), 121
# Order in the number of slices, fitted: the error changes its sign, 3e-5 at 5 slices and 4e-8 at 31 with lubrication.
# With dry friction the slip's sign changes within a slice: 3e-5 and 2e-6.
LEAST_ORDER = {"lubricated": 2.0, "dry": 1.0}
DEFAULT = 1e-5  # of the ratio of cage and shaft, with the scene's own number
ORDERS = {"imex1": 1, "imex2": 2, "ros2": 2}
ORDER = 0.2
DAMPED = {"housing": {"damping": "5e5 Ns/m"}}  # a ring that still swings from its start moves contacts in and out
WINDOW_S, STEPS = 4e-4, (50, 100)  # the default step and half of it are 16 and 33


@pytest.mark.slow
@pytest.mark.parametrize("name", LEAST_ORDER)
def test_cage_speed_converges_with_the_number_of_slices(name: str) -> None:
    def ratio(slices: int | None) -> float:
        number = {} if slices is None else {"line_contact": {"slices": slices}}
        scene = paper_scene(**merged(RIG, RUNS[name], number))
        return float(ratio_of_run(scene, slices_model(scene)).mean())

    exact = ratio(FINEST)
    off = np.abs([ratio(number) - exact for number in NUMBERS])
    order, _ = np.polyfit(np.log(NUMBERS), -np.log(off), 1)
    assert order > LEAST_ORDER[name]
    assert ratio(None) == pytest.approx(exact, abs=DEFAULT)


@pytest.mark.parametrize("method", ORDERS)
@pytest.mark.parametrize("name", ["healthy", "drilled outer race"])
def test_order_in_the_step_at_running_speed(name: str, method: str) -> None:
    scene = paper_scene(**merged(MOVING, DAMPED, CASES[name]))
    model = slices_model(scene)
    y = equilibrium_state(model, cage_angle_rad=scene.load.zone_rad + OVER_RAD)
    recorded(model, y, step_s=RUN_STEP_S, steps=SETTLING_STEPS, method="imex2")
    coarse, fine = errors(model, y, method, STEPS, WINDOW_S)
    assert np.log2(coarse / fine) == pytest.approx(ORDERS[method], abs=ORDER)
