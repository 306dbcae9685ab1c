"""Longest step that each solver can take: of a linear system, of a run's stiffest roller, of the whole bearing.

A model is linearised about static balance by central differences of its equations of motion, with the shaft held and
all velocities zero. Every contact then sticks, and friction has its slope at rest, mu_s N / v_c (eq. (19)), the
steepest one, or in oil the slope at the running speed; elastic forces are those of the balanced contacts. Effects of
rotation (gyroscopic torques, points that enter and leave contact, impacts of a defect) are not included. The maps of
one step are those of `step_kernel`: friction and damping implicit in the velocities, stiffness explicit.

The rollers are the lightest bodies on the stiffest springs, so the one that bounces fastest between the races limits a
run's step. Friction is left out of that: taken explicitly it chatters between bounds but does not diverge.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import ComplexArray, FloatArray
from srbval.bearing import load_bearing
from srbval.models.full.columns import layout_of
from srbval.models.full.equilibrium import equilibrium_state, rolling_speeds
from srbval.models.full.motion_kernel import shaft_motion
from srbval.models.full.parameters import Parameters
from srbval.models.full.slices_kernel import law_at_speed
from srbval.models.full.steps import rates
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.solvers import LEAPFROG, METHODS, Coefficients, Method
from srbval.processes.machine import one_thread
from srbval.scene import Scene

# Eigenvalues closer to zero are bodies that move freely, read with the rounding of the differences [1/s].
FREE_PER_S = 1.0
RAY = np.arange(0.005, 12.0, 0.005)  # |h lambda| looked at; no method here is stable further out
ROUNDING = 1e-9  # excess of |R| over one that counts as stable
# A step map may grow this much faster than the system itself does [1/s]: not noticeable in the runs there are.
GROWTH_PER_S = 1.0
SHORTEST_S, LONGEST_S = 1e-7, 1e-2  # steps looked at for implicit methods
PER_OCTAVE = 2
HALVINGS = 10
# Differences: far below a point's smoothing width of 1e-8 m and the 1 mm/s at which friction turns over (at most 0.2 m
# from an axis), far above rounding.
LENGTH, ANGLE = 1e-10, 1e-9  # m, rad
SPEED, ANGULAR_SPEED = 1e-6, 1e-6  # m/s, rad/s
ANGLES = 3  # cage angles looked at, from a roller on the defect to one on either side of it; the least limit counts


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """q' = `motion` v, v' = `stiffness` q + `damping` v: shapes [q, v], [v, q] and [v, v].

    Of the full model, q are slides, cage angles and ring displacement, v all generalised speeds; the rollers' angles
    about their axes are left out, as nothing depends on them unless a roller is damaged.
    """

    motion: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """The system's matrix, [q + v, q + v]."""
        still = np.zeros((len(self.motion), len(self.motion)))
        return np.block([[still, self.motion], [self.stiffness, self.damping]])


def longest_step(method: Method, system: Linear) -> float | None:
    """Longest step up to which every decaying motion of `system` decays [s]; None if no step tried fails."""
    if not method.implicit:
        return explicit_limit(method, eigenvalues(system))
    grows = max(0.0, float(eigenvalues(system).real.max())) + GROWTH_PER_S

    def stable(h: float) -> bool:
        return spectral_radius(step_map(method, system, h)) <= math.exp(grows * h) + ROUNDING

    low = 0.0
    for h in np.geomspace(SHORTEST_S, LONGEST_S, round(PER_OCTAVE * math.log2(LONGEST_S / SHORTEST_S)) + 1).tolist():
        if not stable(h):
            return _bisect(low, h, stable)
        low = h
    return None


def explicit_limit(method: Method, values: ComplexArray) -> float | None:
    """Longest step of a Runge-Kutta method: |R(h lambda)| <= 1 for every decaying eigenvalue, [k] [1/s]."""
    size = np.abs(values)
    decaying = (size > FREE_PER_S) & (values.real < -1e-9 * size)
    limits = [_reach(method, complex(value / abs(value))) / float(abs(value)) for value in values[decaying]]
    return min(limits, default=None)


def _reach(method: Method, direction: complex) -> float:
    """Distance along `direction`, of modulus one, up to which |R| stays at or below one."""

    def outside(r: NDArray[np.float64]) -> NDArray[np.bool_]:
        ray: ComplexArray = r * np.complex128(direction)
        return np.abs(stability_function(method, ray)) > 1 + ROUNDING

    found = outside(RAY)
    if not found.any():
        return math.inf
    first = int(np.argmax(found))
    low, high = float(RAY[first - 1]) if first else 0.0, float(RAY[first])
    return _bisect(low, high, lambda r: not outside(np.array([r]))[0])


def eigenvalues(system: Linear) -> ComplexArray:
    """Eigenvalues of the system, [q + v] [1/s]."""
    return np.linalg.eigvals(system.matrix).astype(np.complex128)


def spectral_radius(matrix: NDArray[np.float64]) -> float:
    """Largest modulus of an eigenvalue."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _bisect(low: float, high: float, stable: Callable[[float], bool]) -> float:
    """Value between `low` and `high` at which `stable` ends."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def stability_function(method: Method, z: ComplexArray) -> ComplexArray:
    """R(z) = 1 + z b' (1 - z A)^-1 1 of a Runge-Kutta method (Hairer & Wanner 1996, sect. IV.2), of the shape of `z`.

    For an explicit one a polynomial: its coefficients are b' A^k 1.
    """
    a, b = method.coefficients.a, method.coefficients.b
    power = np.ones(len(b))
    total = np.ones_like(z)
    for k in range(1, len(b) + 1):
        total = total + float(b @ power) * z**k
        power = a @ power
    return total


def step_map(method: Method, system: Linear, step_s: float) -> FloatArray:
    """Matrix of one step of an implicit method, [n, n]; n = q + v, and v more if the method remembers a step."""
    coefficients = method.coefficients
    damping = np.eye(len(system.damping)) - coefficients.implicit_coefficient * step_s * system.damping
    damp = np.asarray(np.linalg.inv(damping), dtype=np.float64)
    make = _leapfrog if coefficients.family == LEAPFROG else _rosenbrock
    return make(coefficients, system, step_s, damp)


def _leapfrog(method: Coefficients, system: Linear, h: float, damp: FloatArray) -> FloatArray:
    """q, v and the predicted change of v, as `step_kernel.leapfrog_step` advances them."""
    coordinates, speeds = system.motion.shape
    q, v, ahead = np.split(np.eye(coordinates + 2 * speeds), [coordinates, coordinates + speeds])
    jacobian = system.damping
    q = q + method.c[0] * h * system.motion @ v
    predicted = v + ahead
    rise = system.stiffness @ q + jacobian @ predicted
    first = damp @ (rise - jacobian @ ahead)
    change = method.b[0] * first
    if len(method.b) == 2:
        second = damp @ (rise + jacobian @ (h * first - ahead) - 2 * first)
        change = change + method.b[1] * second
    v = v + h * change
    return np.vstack([q + (1 - method.c[0]) * h * system.motion @ v, v, method.ahead * h * change])


def _rosenbrock(method: Coefficients, system: Linear, h: float, damp: FloatArray) -> FloatArray:
    """q and v, as `step_kernel.rosenbrock_step` advances them; only the velocities are solved for."""
    coordinates = len(system.motion)
    start = np.eye(sum(system.motion.shape))
    solve = np.eye(len(start))
    solve[coordinates:, coordinates:] = damp
    stages: list[FloatArray] = []
    for s in range(len(method.b)):
        trial = start + sum((method.a[s, p] * stages[p] for p in range(s)), np.zeros_like(start))
        right = system.matrix @ trial
        right = right + sum((method.g[s, p] / h * stages[p] for p in range(s)), np.zeros_like(start))
        stages.append(method.implicit_coefficient * h * solve @ right)
    return start + sum((method.b[s] * stages[s] for s in range(len(stages))), np.zeros_like(start))


def elastic_limit_s(method: Method, model: Parameters, state: FloatArray) -> float | None:
    """Longest step at which the stiffest roller's bouncing decays [s]; None if no step tried fails.

    The model is linearised about the static balance in `state`, shape [4 M + 12], with all bodies at rest. Deeper
    contacts on a defect and other moving bodies are left out: see `linearise` for the whole model.
    """
    at_rest = state.copy()
    at_rest[layout_of(state).half :] = 0.0
    return longest_step(method, stiffest_roller(without_friction(held(model)), at_rest))


def stiffest_roller(model: Parameters, state: FloatArray) -> Linear:
    """The roller with the stiffest contacts, along its slot, everything else held.

    A slide's acceleration depends on its own roller's slide and speed alone, so all rollers are moved at once.
    """
    layout = layout_of(state)
    own = layout.slide_rate
    stiffness = central_difference(model, state, layout.slide, LENGTH)[own]
    damping = central_difference(model, state, own, SPEED)[own]
    one = slice(int(np.argmin(stiffness)), int(np.argmin(stiffness)) + 1)
    return Linear(motion=np.ones((1, 1)), stiffness=stiffness[one, None], damping=damping[one, None])


def central_difference(model: Parameters, state: FloatArray, part: slice | int, size: float) -> FloatArray:
    """Change of the rates per change of a part of the state, by moving it by `size` to either side."""
    there, back = state.copy(), state.copy()
    there[part] += size
    back[part] -= size
    return (rates(model, 0.0, there).rate - rates(model, 0.0, back).rate) / (2 * size)


def held(model: Parameters) -> Parameters:
    """The model with its shaft held at angle zero; friction in oil keeps the slope that it has at the shaft's speed."""
    if model.slices is not None:
        law = law_at_speed(model.law, model.slices, rolling_speeds(model)[0], shaft_motion(0.0, model.drive)[0])
        model = model._replace(law=law, slices=model.slices._replace(critical_ratio=0.0))
    return model._replace(drive=model.drive._replace(speed=np.zeros((3, 1))))


def without_friction(model: Parameters) -> Parameters:
    """The model with its elastic and damping forces alone."""
    return model._replace(law=model.law._replace(static_friction=0.0, dynamic_friction=0.0))


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
    limit the rollers are thrown about. None: no step up to `LONGEST_S` fails.
    """

    def least(solver: str, systems: Sequence[Linear]) -> float | None:
        limits = (longest_step(METHODS[solver], system) for system in systems)
        return min((limit for limit in limits if limit is not None), default=None)

    with one_thread():  # small matrices: waiting for other threads takes longer than the work
        states = [balanced(scene, pitches=pitches) for pitches in np.linspace(0.0, 0.5, ANGLES)]
        whole = [linearise(model, state) for model, state in states]
        elastic = [linearise(without_friction(model), state) for model, state in states]
        return {solver: (least(solver, whole), least(solver, elastic)) for solver in solvers}
