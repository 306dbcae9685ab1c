"""Longest stable step of each solver: for a linear system, for a run's stiffest roller, and for the whole bearing.

A model is linearised about static balance by central differences of its equations of motion, with the shaft and all
bodies at rest. No contact slips then, and from zero slip friction rises most steeply; in oil, this rise depends on the
speed and is computed at the running speed. Effects of rotation (gyroscopic torques, points that enter and leave
contact, impacts of a defect) are not included. Each step is a linear map, as in `step_kernel`: friction and damping
implicit, stiffness explicit.

The rollers are the lightest bodies on the stiffest springs, so the roller that bounces fastest between the races limits
the step of a run. This limit does not include friction, which chatters within bounds if it is integrated explicitly.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.models.full.columns import layout_of
from srbval.models.full.equilibrium import equilibrium_state, rolling_speeds
from srbval.models.full.motion_kernel import shaft_motion
from srbval.models.full.parameters import Parameters
from srbval.models.full.rates import rates
from srbval.models.full.slices_kernel import law_at_speed
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.solvers import METHODS, Method
from srbval.processes.machine import one_thread
from srbval.scene import Scene

# Eigenvalues closer to zero belong to free motion of bodies and are due to rounding of the differences [1/s].
FREE_PER_S = 1.0
ROUNDING = 1e-9  # excess of |R| over one that counts as stable
# Growth of a step's map beyond that of the system which counts as stable [1/s]; negligible in any run.
GROWTH_PER_S = 1.0
MIN_IMPLICIT_S, MIN_EXPLICIT_S, MAX_STEP_S = 1e-6, 1e-9, 1e-2  # shortest steps tested, by kind of method; longest
PER_OCTAVE = 2
BISECTIONS = 12
# Changes for central differences: far above rounding, and far below the smoothing width of a point, 1e-8 m, and the
# velocity of 1 mm/s at which friction is highest (at most 0.2 m from an axis).
LENGTH_CHANGE_M, ANGLE_CHANGE_RAD = 1e-10, 1e-9  # m, rad
SPEED_CHANGE_M_S, ANGULAR_CHANGE_RAD_S = 1e-6, 1e-6  # m/s, rad/s
CAGE_ANGLES = 3  # from a roller on the defect to the defect midway between two; the shortest limit counts


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearSystem:
    """Linear equations of motion dq/dt = `motion` v, dv/dt = `stiffness` q + `damping` v of coordinates q and speeds v.

    In the full model, q contains the angles of the cages and the displacements of the ring, and of each roller towards
    the outer race; v contains all speeds. Angles of rollers about their axes are left out: they have no effect unless a
    roller is damaged.
    """

    motion: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """Matrix A of the system in the form dx/dt = A x, where x contains q and then v."""
        still = np.zeros((len(self.motion), len(self.motion)))
        return np.block([[still, self.motion], [self.stiffness, self.damping]])


def longest_step(method: Method, system: LinearSystem) -> float | None:
    """Longest step [s] with which decaying motions of `system` do not grow; None if this holds for all tested steps."""
    eigenvalues = np.linalg.eigvals(system.matrix).astype(np.complex128)
    size, grows = np.abs(eigenvalues), max(0.0, float(eigenvalues.real.max())) + GROWTH_PER_S
    decaying = eigenvalues[(size > FREE_PER_S) & (eigenvalues.real < -1e-9 * size)]

    def stable(h: float) -> bool:
        if method.implicit:
            return bool(np.abs(np.linalg.eigvals(step_map(method, system, h))).max() <= math.exp(grows * h) + ROUNDING)
        # an explicit step multiplies a motion by a polynomial in h times eigenvalue (Hairer & Wanner 1996, sect. IV.2)
        powers = [method.b @ np.linalg.matrix_power(method.a, k).sum(axis=1) for k in range(len(method.b))]
        factors = np.polynomial.Polynomial([1.0, *powers])(h * decaying)
        return bool((np.abs(factors) <= 1 + ROUNDING).all())

    low, shortest = 0.0, MIN_IMPLICIT_S if method.implicit else MIN_EXPLICIT_S
    for high in np.geomspace(shortest, MAX_STEP_S, round(PER_OCTAVE * math.log2(MAX_STEP_S / shortest)) + 1).tolist():
        if not stable(high):
            for _ in range(BISECTIONS):
                middle = (low + high) / 2
                low, high = (middle, high) if stable(middle) else (low, middle)
            return low
        low = high
    return None


def step_map(method: Method, system: LinearSystem, step_s: float) -> FloatArray:
    """Matrix by which one step of an implicit method multiplies the state of a system.

    The state contains coordinates q, speeds v, and the predicted change of v in the next step, zero for imex1.
    """
    h, jacobian = step_s, system.damping
    coordinates, speeds = system.motion.shape
    damp = np.linalg.inv(np.eye(speeds) - method.implicit_coefficient * h * jacobian)
    q, v, ahead = np.split(np.eye(coordinates + 2 * speeds), [coordinates, coordinates + speeds])
    q = q + method.c[0] * h * system.motion @ v
    rise = system.stiffness @ q + jacobian @ (v + ahead)
    first = damp @ (rise - jacobian @ ahead)
    change = method.b[0] * first
    if len(method.b) == 2:
        second = damp @ (rise + jacobian @ (h * first - ahead) - 2 * first)
        change = change + method.b[1] * second
    v = v + h * change
    return np.vstack([q + (1 - method.c[0]) * h * system.motion @ v, v, method.ahead * h * change])


def elastic_limit_s(method: Method, model: Parameters, state: FloatArray) -> float | None:
    """Longest step [s] with which a roller that bounces between the races comes to rest; None if there is no limit.

    The model is linearised about the static balance `state`, with all bodies at rest and without friction. Only the
    roller with the stiffest contacts moves, towards the outer race and back. Impacts at a defect, in which contacts are
    stiffer, are not included.
    """
    at_rest, layout = state.copy(), layout_of(state)
    at_rest[layout.half :] = 0.0
    model, rate = without_friction(with_resting_shaft(model)), layout.slide_rate
    # a roller's acceleration depends only on its own position and speed, so all rollers are moved at once
    stiffness = central_difference(model, at_rest, layout.slide, LENGTH_CHANGE_M)[rate]
    damping = central_difference(model, at_rest, rate, SPEED_CHANGE_M_S)[rate]
    stiffest = [int(np.argmin(stiffness))]
    system = LinearSystem(motion=np.ones((1, 1)), stiffness=stiffness[stiffest, None], damping=damping[stiffest, None])
    return longest_step(method, system)


def central_difference(model: Parameters, state: FloatArray, part: slice | int, size: float) -> FloatArray:
    """Derivative of the state's rates of change with respect to its entries `part`, which change by +-`size`."""
    there, back = state.copy(), state.copy()
    there[part] += size
    back[part] -= size
    return (rates(model, 0.0, there).rate - rates(model, 0.0, back).rate) / (2 * size)


def with_resting_shaft(model: Parameters) -> Parameters:
    """Copy the model with the shaft at rest, at angle zero; friction in oil rises with slip as at running speed."""
    if model.slices is not None:
        law = law_at_speed(model.law, model.slices, rolling_speeds(model)[0], shaft_motion(0.0, model.drive)[0])
        model = model._replace(law=law, slices=model.slices._replace(critical_ratio=0.0))
    return model._replace(drive=model.drive._replace(speed=np.zeros((3, 1))))


def without_friction(model: Parameters) -> Parameters:
    """Copy the model without friction."""
    return model._replace(law=model.law._replace(static_friction=0.0, dynamic_friction=0.0))


def balance_scene(scene: Scene, *, pitches: float = 0.0) -> tuple[Parameters, FloatArray]:
    """Parameters of the scene's model with a resting shaft, and its state in static balance, with zero velocities.

    The cage is turned by `pitches` times the rollers' spacing.
    """
    geometry = geometry_of(load_bearing(scene.bearing))
    model = level_of(scene.model).make_parameters(scene, geometry)
    angle = pitches * 2 * math.pi / geometry.rollers_per_row
    state = equilibrium_state(model, cage_angle_rad=angle)
    state[len(state) // 2 :] = 0.0
    return with_resting_shaft(model), state


def linearise(model: Parameters, state: FloatArray) -> LinearSystem:
    """Linearise the equations of motion of `model` about `state`, at time zero."""
    layout = layout_of(state)
    sizes = np.repeat([ANGLE_CHANGE_RAD, ANGULAR_CHANGE_RAD_S], layout.half)  # change of each coordinate
    sizes[layout.slide] = sizes[layout.ring] = LENGTH_CHANGE_M
    sizes[layout.slide_rate] = sizes[layout.ring_rate] = SPEED_CHANGE_M_S
    whole = np.column_stack([central_difference(model, state, i, size) for i, size in enumerate(sizes)])
    half, q = layout.half, np.r_[layout.slide, layout.cage, layout.ring, layout.relative_angle]
    return LinearSystem(motion=whole[q, half:], stiffness=whole[half:][:, q], damping=whole[half:, half:])


def predict(scene: Scene, solvers: Sequence[str]) -> dict[str, tuple[float | None, float | None]]:
    """Predict the longest stable step [s] of each solver for a scene, with friction and without.

    Above the limit with friction an explicit method chatters within bounds; above the limit without friction the
    rollers bounce ever higher. None: all steps up to `MAX_STEP_S` are stable.
    """

    def least(solver: str, systems: Sequence[LinearSystem]) -> float | None:
        limits = (longest_step(METHODS[solver], system) for system in systems)
        return min((limit for limit in limits if limit is not None), default=None)

    with one_thread():  # small matrices: waiting for other threads takes longer than the work
        states = [balance_scene(scene, pitches=pitches) for pitches in np.linspace(0.0, 0.5, CAGE_ANGLES)]
        whole = [linearise(model, state) for model, state in states]
        elastic = [linearise(without_friction(model), state) for model, state in states]
        return {solver: (least(solver, whole), least(solver, elastic)) for solver in solvers}
