"""Start of a run: ring and rollers in static balance with the load, cage and rollers rolling.

The unknowns are the three displacements of the ring and the slide of each roller, outwards along its slot in the cage.
Without friction the contact forces have a potential, convex for small displacements; a roller's slide affects only its
own balance and the ring's. For a given ring position, a bracketed Newton iteration finds all slides at once; around
it, a Newton iteration finds the ring position. The slides are eliminated from the ring's stiffness (Schur complement);
the line search uses only forces. Forces come from `right_hand_side`, the equations of motion.

A run that starts from here has a steady ring and cage from the first sample on
(`test_a_run_is_settled_from_its_first_sample`). During the first roller passage, the time 1 / BPFO, the RMS
acceleration is 0.95 to 1.01 times the later RMS, so that settling for two passages, 0.02 s at 710 rpm, is enough.

The cage's tilt starts at zero, not in balance: with Giraudo's roller diameter it grows to 20 microradians in 0.1 s,
without effect on the ring. Under radial and axial load without a housing spring, the cage's tilt, the ring's axial
position (by 1 %) and the cage speed (by 0.4 %) change for 0.15 s at 710 rpm; such a run should settle for one turn of
the cage, 0.2 s.
"""

from collections.abc import Callable

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.motion_kernel import external_load, shaft_motion
from srbval.models.full.parameters import Parameters, state_layout
from srbval.models.full.rates import rates
from srbval.models.outputs import DEPTH_LIMIT_M

RING_TOLERANCE_N = 1e-2  # residual at which the iteration stops; rounding leaves 1e-5 N at the paper's stiffness
BALANCED_N = 1.0  # largest residual in balance: a ring with play and no load has no stiffness
SLIDE_TOLERANCE_N = 1e-4
NUDGE_M = 1e-9  # difference quotients; far below the depth of any loaded contact, far above rounding
FREE_N_M = 1e4  # below this stiffness a roller has no contact: one point of the paper has 5e7 N/m
SOFTEST_N_M = 1e6  # least stiffness of the ring, so that the Newton step of a free ring stays finite
LONGEST_STEP_M = 1e-4  # largest step of the ring in one iteration
OVERSHOOT = 0.5  # largest reversed force along a step, as a share of the force at its start
SLIDE_RANGE_M = 3e-3  # beyond the clearance; more than any defect (1 mm) and any contact depth
MAX_UNCARRIED_SHARE = 0.01  # largest share of the load without support in an accepted scene
RING_STEPS = 60
SLIDE_STEPS = 80
BACKTRACKS = 12
CAGE_RANGE = 0.05  # about pure rolling; the outer and inner circles alone would give -1.5 % and +2.6 %
SPIN_RANGE = 0.15  # about pure rolling; 6 % occurred
MIN_ACCELERATION_RAD_S2 = 1e-3  # rounding causes 1e-9, the lightest rolling contact thousands
SPIN_HALVINGS = 20  # 7e-5 rad/s of a spin: 1.4 um/s of slip, a thousandth of the critical velocity


def equilibrium_state(model: Parameters, *, cage_angle_rad: float = 0.0) -> FloatArray:
    """Compute the state vector at time zero: ring and rollers in static balance, cage and rollers rolling.

    The forces are the load, the housing spring, gravity, the frictionless contacts and the rollers' centrifugal force,
    which presses unloaded rollers outwards, at the cage speed of pure rolling. The cage is turned by `cage_angle_rad`
    and not tilted. Friction and contact damping do not change the displacements.

    Raises `ConfigurationError` if a roller penetrates a raceway deeper than `DEPTH_LIMIT_M`, or if the rollers leave
    more than `MAX_UNCARRIED_SHARE` of the load unsupported.
    """
    statics = Statics(model, cage_angle_rad)
    ring = np.zeros(3)
    slide, left = _balance_slides(statics, ring, np.zeros(statics.layout.rollers))
    for _ in range(RING_STEPS):
        if np.abs(left).max() < RING_TOLERANCE_N:
            break
        ring, slide, left = _line_search(statics, ring, slide, left, _ring_step(statics, ring, slide, left))
    slide_n, ring_n, deepest = statics.forces(slide, ring)
    if deepest > DEPTH_LIMIT_M:
        raise ConfigurationError(
            f"load or interference overload the contact: a roller would penetrate a race by {deepest * 1e6:.4g} um; "
            f"the limit is {DEPTH_LIMIT_M * 1e6:.4g} um; reduce load or interference, or raise the contact stiffness."
        )
    left_n = max(float(np.abs(slide_n).max()), float(np.abs(ring_n).max()))
    allowed = BALANCED_N + MAX_UNCARRIED_SHARE * float(np.hypot(*external_load(0.0, model.drive)))
    if left_n > allowed:
        raise ConfigurationError(
            f"no static balance: the rollers do not carry {left_n:.4g} N of the load; the limit is {allowed:.4g} N. "
            "Reduce the play if it is too large, or the load if it moves the contacts too far from the rollers' middle."
        )
    y = statics.y.copy()
    y[statics.layout.slide], y[statics.layout.ring] = slide, ring
    return balance_friction(model, y)


class Statics:
    """Model without friction for the static balance; its shaft is at rest, at its angle at time zero."""

    def __init__(self, model: Parameters, cage_angle_rad: float) -> None:
        self.layout = state_layout(model)
        self.cage_speed, _ = rolling_speeds(model)
        _, angle = shaft_motion(0.0, model.drive)
        held = model.drive._replace(speed=np.array([[0.0], [0.0], [angle]]))
        law = model.law._replace(static_friction=0.0, dynamic_friction=0.0)
        self.rest = model._replace(drive=held, law=law)
        self.y = np.zeros(2 * self.layout.half)
        self.y[self.layout.cage] = 0.0, 0.0, cage_angle_rad

    def forces(self, slide: FloatArray, ring: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Compute outward forces on rollers displaced by `slide`, force on the ring [N], largest penetration [m]."""
        model, layout = self.rest, self.layout
        self.y[layout.slide], self.y[layout.ring] = slide, ring
        found = rates(model, 0.0, self.y)
        swing = (self.cage_speed * model.tilt_cosine) ** 2  # square of the speed about the axis across the slot
        slide_n = model.roller_mass * (found.rate[layout.slide_rate] + (model.centre_distance + slide) * swing)
        return slide_n, model.ring_mass * found.rate[layout.ring_rate], float(found.totals[col.DEEPEST])

    def slide_stiffness(self, slide: FloatArray, ring: FloatArray, slide_n: FloatArray) -> FloatArray:
        """Compute each roller's stiffness to radial displacement `slide` [N/m]; `slide_n`: radial forces there [N]."""
        return (slide_n - self.forces(slide + NUDGE_M, ring)[0]) / NUDGE_M


def _balance_slides(statics: Statics, ring: FloatArray, slide: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Find outward displacements that balance the rollers, for a `ring` position, and the force on the ring [N]."""
    model = statics.rest
    clearance = abs(model.race_radius[0] - model.law.roller_radius - model.centre_distance)
    far = clearance + float(np.linalg.norm(ring)) + SLIDE_RANGE_M
    low, high = np.full_like(slide, -far), np.full_like(slide, far)
    for _ in range(SLIDE_STEPS):
        slide_n, ring_n, _ = statics.forces(slide, ring)
        if np.abs(slide_n).max() < SLIDE_TOLERANCE_N:
            break
        # a roller pushed outwards has its balance further out; a roller without a force moves to the outer race
        low, high = np.where(slide_n >= 0, slide, low), np.where(slide_n < 0, slide, high)
        stiffness = statics.slide_stiffness(slide, ring, slide_n)
        newton = slide + slide_n / np.where(stiffness > FREE_N_M, stiffness, np.nan)
        slide = np.where((newton > low) & (newton < high), newton, (low + high) / 2)
    return slide, ring_n


def _ring_step(statics: Statics, ring: FloatArray, slide: FloatArray, ring_n: FloatArray) -> FloatArray:
    """Compute a Newton step of the ring's position [m], at most `LONGEST_STEP_M`, with the rollers kept in balance."""
    slide_n, _, _ = statics.forces(slide, ring)
    stiffness = statics.slide_stiffness(slide, ring, slide_n)
    moved = [statics.forces(slide, ring + NUDGE_M * axis) for axis in np.eye(3)]
    own = np.array([(ring_n - m[1]) / NUDGE_M for m in moved])
    coupling = np.array([(slide_n - m[0]) / NUDGE_M for m in moved])
    softened = coupling / np.where(stiffness > FREE_N_M, stiffness, np.inf)
    whole = own - softened @ coupling.T
    whole = (whole + whole.T) / 2
    softest = float(np.linalg.eigvalsh(whole)[0])
    step: FloatArray = np.linalg.solve(whole + max(0.0, SOFTEST_N_M - softest) * np.eye(3), ring_n)
    return step * min(1.0, LONGEST_STEP_M / float(np.linalg.norm(step)))


def _line_search(
    statics: Statics, ring: FloatArray, slide: FloatArray, ring_n: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shorten the ring's `step` until the force at its end no longer pushes the ring back strongly.

    A force against the step at its end may be `OVERSHOOT` times the force along it at its start, from `ring_n`. Returns
    the ring's position, the rollers' balanced outward displacements [m] and the force on the ring [N] at the end.
    """
    share, first = 1.0, float(ring_n @ step)
    for _ in range(BACKTRACKS):
        trial = ring + share * step
        followed, left = _balance_slides(statics, trial, slide)
        along = float(left @ step)
        if along >= -OVERSHOOT * first:
            break
        share *= min(0.9, max(0.1, first / (first - along)))
    return trial, followed, left


def rolling_speeds(model: Parameters) -> tuple[float, float]:
    """Compute the cage speed and the roller spin of pure rolling in the middle of the contacts, at time zero [rad/s].

    The cage turns at (1 - d cos(alpha) / D) / 2 times the shaft speed, with roller diameter d, contact angle alpha and
    pitch diameter D (Randall 2011, sect. 2.2.3); with this spin, rollers do not slip on the outer race.
    """
    pitch_radius = model.centre_distance * model.tilt_cosine
    shaft = shaft_motion(0.0, model.drive)[0]
    cage = shaft / 2 * (1 - model.law.roller_radius * model.tilt_cosine / pitch_radius)
    return cage, -cage * pitch_radius / model.law.roller_radius


def balance_friction(model: Parameters, state: FloatArray) -> FloatArray:
    """Find the cage speed and roller spins at which friction on cage and rollers balances; returns `state` with them.

    A roller touches a race on three circles of points with different rolling radii. The circles cannot all roll, so
    friction decides the speeds: bisection finds the cage speed, and an inner bisection the spins. A roller without
    traction gets the others' median spin; a cage without traction keeps the speed of pure rolling. Other velocities are
    zero.
    """
    rolling, _ = rolling_speeds(model)

    def cage_acceleration(speed: FloatArray) -> FloatArray:
        balanced = _balance_spins(model, state, float(speed[0]))
        return rates(model, 0.0, balanced).rate[state_layout(model).shaft_cage_rate]

    (cage,) = _falling_root(cage_acceleration, np.array([rolling]), CAGE_RANGE)
    return _balance_spins(model, state, float(cage))


def _balance_spins(model: Parameters, state: FloatArray, cage: float) -> FloatArray:
    """Copy `state` with the given `cage` speed [rad/s] and the spins at which friction has no torque on the rollers."""
    layout = state_layout(model)
    spins = layout.spin
    y = state.copy()
    y[layout.half :] = 0.0
    y[layout.shaft_cage_rate] = cage

    def spin_acceleration(spin: FloatArray) -> FloatArray:
        y[spins] = spin
        return rates(model, 0.0, y).rate[spins]

    rolling = np.full(layout.rollers, -cage * model.centre_distance * model.tilt_cosine / model.law.roller_radius)
    y[spins] = _falling_root(spin_acceleration, rolling, SPIN_RANGE)
    return y


def _falling_root(f: Callable[[FloatArray], FloatArray], guess: FloatArray, share: float) -> FloatArray:
    """Find the zero of each component of the decreasing function `f` by bisection, within `guess` (1 +- `share`).

    A component without a zero gets the median of the others' zeros, or the guess if none has a zero.
    """
    low, high = guess - share * np.abs(guess), guess + share * np.abs(guess)
    passes = (f(low) > MIN_ACCELERATION_RAD_S2) & (f(high) < -MIN_ACCELERATION_RAD_S2)
    if not passes.any():
        return (low + high) / 2
    for _ in range(SPIN_HALVINGS):
        trial = (low + high) / 2
        rising = f(trial) > 0
        low, high = np.where(rising, trial, low), np.where(rising, high, trial)
    found = (low + high) / 2
    return np.where(passes, found, np.median(found[passes]))
