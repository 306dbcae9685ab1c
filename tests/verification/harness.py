"""The one place where the checks reach into the model under test: parameters, start, rates, steps."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import SphericalRollerGeometry, load_bearing
from srbval.models import outputs as out_col
from srbval.models.full import columns as col
from srbval.models.full.columns import FAR_M
from srbval.models.full.columns import layout_of as layout_of
from srbval.models.full.damping_kernel import BORDER, factor, solve
from srbval.models.full.equilibrium import rolling_speeds
from srbval.models.full.motion_kernel import WITH_DAMPING, external_load, right_hand_side
from srbval.models.full.parameters import Parameters as Parameters
from srbval.models.full.parameters import state_layout
from srbval.models.full.rates import Rates as Rates
from srbval.models.full.rates import rates as rates
from srbval.models.full_run import FullRun
from srbval.models.hierarchy import level_of
from srbval.models.solvers import METHODS, Method
from srbval.scene import Scene as Scene
from srbval.scene import merge
from srbval.scene import paper_scene as paper_scene

FloatArray = NDArray[np.float64]
SUPPLIED = [out_col.MEAN_DRIVE_POWER, out_col.MEAN_LOAD_POWER]
LOST = [out_col.MEAN_FRICTION_POWER, out_col.MEAN_DAMPING_POWER, out_col.MEAN_HOUSING_POWER]
PAPER_STEP_S = 1 / 61440
PRINTED_FIT = {"roller_fit": "printed"}  # every roller is pressed by both races: nothing rattles


def geometry() -> SphericalRollerGeometry:
    """The paper's bearing."""
    return load_bearing("skf-22240").geometry


def merged(*tables: dict[str, Any]) -> dict[str, Any]:
    """Scene changes laid over each other."""
    return functools.reduce(merge, tables, {})


def parameters(scene: Scene) -> Parameters:
    """Kernel parameters of a scene, for its model."""
    return level_of(scene.model).make_parameters(scene, geometry())


def rolling_state(model: Parameters) -> FloatArray:
    """State of pure rolling at the middle circle, all slides zero, shape [4 M + 12].

    The ring stands where the housing spring alone would carry the load. Not an equilibrium: what remains dies out
    in the scene's settling time; see `equilibrium.py` for one.
    """
    layout = state_layout(model)
    y = np.zeros(2 * layout.half)
    y[layout.shaft_cage_rate], y[layout.spin] = rolling_speeds(model)
    if model.housing_stiffness > 0:
        radial, axial = external_load(0.0, model.drive)
        push = (radial * model.drive.direction_cosine, radial * model.drive.direction_sine, axial)
        y[layout.ring] = np.array(push) / model.housing_stiffness
    return y


def full_run(model: Parameters, y: FloatArray, method: Method, step_s: float, steps: int = 1) -> FullRun:
    """Run that advances `y` in place, at its start, with `steps` steps in each output interval."""
    return FullRun(model, method, y, np.zeros_like(y), 1 / (step_s * steps), steps)


def advance(
    model: Parameters, y: FloatArray, *, step_s: float, steps: int, method: str = "ode4", outputs: int = 1
) -> FloatArray:
    """Advance `y` in place from time zero by `outputs` intervals of `steps` steps; what a run records, row by row."""
    return full_run(model, y, METHODS[method], step_s, steps=steps).advance(0, outputs).out


def rate_of_change(function: Callable[[float, FloatArray], Any], y: FloatArray, rate: FloatArray, span_s: float) -> Any:
    """Difference quotient of a function of time and state over `span_s` to either side of `y`, along its rates."""
    return (function(span_s, y + span_s * rate) - function(-span_s, y - span_s * rate)) / (2 * span_s)


def shaft_reversed(model: Parameters) -> Parameters:
    """The same model with its shaft turning the other way."""
    return model._replace(drive=model.drive._replace(speed=model.drive.speed * [[1.0], [-1.0], [-1.0]]))


def only_circle(model: Parameters, circle: int) -> Parameters:
    """The model with the points of the two other circles (1 to 3) put out of reach."""
    points = model.races.points.copy()
    for race, starts in zip(points, model.races.starts, strict=True):
        for window, start in zip(race, starts, strict=True):
            radial = window[col.POINT_RADIAL]
            radial[: start[circle - 1]] = radial[start[circle] :] = FAR_M
    return model._replace(races=model.races._replace(points=points))


def runge_kutta_step(model: Parameters, y: FloatArray, t: float, step_s: float) -> FloatArray:
    """One classical Runge-Kutta step of `y`, in place; mean contact values of its stages."""
    stages = [rates(model, t, y)]
    for share in (0.5, 0.5, 1.0):
        stages.append(rates(model, t + share * step_s, y + share * step_s * stages[-1].rate))
    rate, totals = (np.average(part, axis=0, weights=(1, 2, 2, 1)) for part in list(zip(*stages, strict=True))[:2])
    y += step_s * rate
    return totals


def implicit_response(
    model: Parameters, t: float, y: FloatArray, weight_s: float
) -> Callable[[FloatArray], FloatArray]:
    """The x of (M + `weight_s` D) x = M a for accelerations a, as the model finds it at state `y`; both [S]."""
    totals, factors = np.zeros(col.TOTALS), np.zeros((col.FACTOR_ROWS, BORDER))
    right_hand_side(t, y, model, np.zeros_like(y), totals, None, WITH_DAMPING)
    factor(weight_s, model, totals, factors)

    def response(acceleration: FloatArray) -> FloatArray:
        whole = np.concatenate([np.zeros_like(acceleration), acceleration])
        solve(weight_s, model, totals, factors, whole)
        return whole[len(acceleration) :]

    return response


def stepped(
    model: Parameters, y: FloatArray, method: str, *, step_s: float, first: int, steps: int
) -> tuple[list[FloatArray], FloatArray]:
    """States after each of `steps` steps of a method, the first of which is step number `first`; `y` is left alone.

    And the powers of drive and of all losses in each, [steps, 2] [W].

    Without its averaging of contact onsets, which is a matter of the contact law: `tests/models/full/test_contact.py`.
    """
    state, states, powers = y.copy(), [], []
    run = full_run(model, state, METHODS[method]._replace(onset=0.0), step_s)
    for i in range(first, first + steps):
        out = run.advance(i, 1).out
        states.append(state.copy())
        powers.append([out[0, out_col.MEAN_DRIVE_POWER], out[0, LOST].sum()])
    return states, np.array(powers)
