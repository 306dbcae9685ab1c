"""The longest step a run's method can take, told before it begins: its stiffest roller between the races.

The rollers are the lightest bodies on the stiffest springs, so the one that bounces fastest decides. Friction is left
out: taken explicitly it chatters between bounds but does not diverge.
"""

import numpy as np

from srbval.arrays import FloatArray
from srbval.models.full.drive_kernel import shaft_motion
from srbval.models.full.equilibrium import rolling_speeds
from srbval.models.full.parameters import Parameters
from srbval.models.full.slices_kernel import law_at_speed
from srbval.models.full.state import layout_of
from srbval.models.full.steps import rates
from srbval.models.solvers import Method
from srbval.models.solvers.linear_stability import Linear, longest_step

SLIDE_M, SLIDE_RATE_M_S = 1e-10, 1e-6  # differences: far below the contacts' smoothing, far above rounding


def elastic_limit_s(method: Method, model: Parameters, state: FloatArray) -> float | None:
    """Longest step at which the stiffest roller's bouncing decays [s]; None where no step looked at fails.

    Linear about the displacements in `state`, one of static balance, shape [4 M + 12], with shaft and all else at rest:
    moving past a point that just touches, the damper would look like a spring. Neither deeper contacts later, as on a
    defect, nor other bodies moving along are in it: `srbval stability` makes the whole model linear.
    """
    at_rest = state.copy()
    at_rest[layout_of(state).half :] = 0.0
    return longest_step(method, stiffest_roller(without_friction(held(model)), at_rest))


def stiffest_roller(model: Parameters, state: FloatArray) -> Linear:
    """The roller with the stiffest contacts, along its slot, everything else held.

    A slide's acceleration depends on its own roller's slide and speed alone, so all rollers are moved at once.
    """
    layout = layout_of(state)

    def slope(part: slice, size: float) -> FloatArray:
        there, back = state.copy(), state.copy()
        there[part] += size
        back[part] -= size
        difference = rates(model, 0.0, there).rate - rates(model, 0.0, back).rate
        found: FloatArray = difference[layout.slide_rate] / (2 * size)
        return found

    stiffness, damping = slope(layout.slide, SLIDE_M), slope(layout.slide_rate, SLIDE_RATE_M_S)
    stiffest = int(np.argmin(stiffness))
    return Linear(
        motion=np.ones((1, 1)),
        stiffness=stiffness[stiffest].reshape(1, 1),
        damping=damping[stiffest].reshape(1, 1),
    )


def held(model: Parameters) -> Parameters:
    """The model with its shaft held at angle zero; friction in oil keeps the slope that it has at the shaft's speed."""
    if model.slices is not None:
        law = law_at_speed(model.law, model.slices, rolling_speeds(model)[0], shaft_motion(0.0, model.drive)[0])
        model = model._replace(law=law, slices=model.slices._replace(critical_ratio=0.0))
    return model._replace(drive=model.drive._replace(speed=np.zeros((3, 1))))


def without_friction(model: Parameters) -> Parameters:
    """The model with its elastic and damping forces alone."""
    return model._replace(law=model.law._replace(static_friction=0.0, dynamic_friction=0.0))
