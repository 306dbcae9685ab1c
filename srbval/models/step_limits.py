"""Step limits of each solver, from the scene's model linearised about static balance.

The model is linearised by central differences of its equations of motion, with the shaft held and all velocities zero.
Every contact then sticks, and friction has its slope at rest, mu_s N / v_c (eq. (19)), the steepest one, or in oil the
slope at the running speed; elastic forces are those of the balanced contacts. Effects of rotation (gyroscopic torques,
points that enter and leave contact, impacts of a defect) are not included.
"""

import math
from collections.abc import Sequence

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.models.full.columns import layout_of
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters
from srbval.models.full_run import central_difference, held, without_friction
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.linear_stability import Linear, longest_step
from srbval.models.solvers import METHODS
from srbval.processes.machine import one_thread
from srbval.scene import Scene

# Differences: far below a point's smoothing width of 1e-8 m and the 1 mm/s at which friction turns over (at most 0.2 m
# from an axis), far above rounding.
LENGTH, ANGLE = 1e-10, 1e-9  # m, rad
SPEED, ANGULAR_SPEED = 1e-6, 1e-6  # m/s, rad/s
ANGLES = 3  # cage angles looked at, from a roller on the defect to one on either side of it; the least limit counts


def balanced(scene: Scene, *, pitches: float = 0.0) -> tuple[Parameters, FloatArray]:
    """The scene's parameters with the shaft held, and its balanced state with all velocities zero, [4 M + 12].

    The cage is turned by `pitches` of the rollers' spacing.
    """
    geometry = geometry_of(load_bearing(scene.bearing))
    model = level_of(scene.model).make_parameters(scene, geometry)
    angle = pitches * 2 * math.pi / geometry.rollers_per_row
    state = equilibrium_state(model, cage_angle_rad=angle)
    state[len(state) // 2 :] = 0.0
    return held(model), state


def linearise(model: Parameters, state: FloatArray) -> Linear:
    """Linearise `model` about `state`, of shape [4 M + 12], at time zero."""
    layout = layout_of(state)
    sizes = np.repeat([ANGLE, ANGULAR_SPEED], layout.half)  # of each coordinate's difference
    sizes[layout.slide] = sizes[layout.ring] = LENGTH
    sizes[layout.slide_rate] = sizes[layout.ring_rate] = SPEED
    whole = np.column_stack([central_difference(model, state, i, size) for i, size in enumerate(sizes)])
    half, q = layout.half, np.r_[layout.slide, layout.cage, layout.ring, layout.relative_angle]
    return Linear(motion=whole[q, half:], stiffness=whole[half:][:, q], damping=whole[half:, half:])


def predict(scene: Scene, solvers: Sequence[str]) -> dict[str, tuple[float | None, float | None]]:
    """Longest stable steps [s] of each solver at the scene's speed and load: of the whole system, and without friction.

    Beyond the limit with friction an explicit method does not diverge but chatters within bounds; beyond the elastic
    limit the rollers are thrown about. None: no step up to `linear_stability.LONGEST_S` fails.
    """

    def least(solver: str, systems: Sequence[Linear]) -> float | None:
        limits = (longest_step(METHODS[solver], system) for system in systems)
        return min((limit for limit in limits if limit is not None), default=None)

    with one_thread():  # small matrices: waiting for other threads takes longer than the work
        states = [balanced(scene, pitches=pitches) for pitches in np.linspace(0.0, 0.5, ANGLES)]
        whole = [linearise(model, state) for model, state in states]
        elastic = [linearise(without_friction(model), state) for model, state in states]
        return {solver: (least(solver, whole), least(solver, elastic)) for solver in solvers}
