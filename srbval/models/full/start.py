"""Velocities a run starts with: of pure rolling, or such that friction balances."""

from collections.abc import Callable

import numpy as np

from srbval.arrays import FloatArray
from srbval.models.full.drive_kernel import shaft_motion
from srbval.models.full.parameters import Parameters, state_layout
from srbval.models.full.steps import rates

CAGE_RANGE = 0.05  # about pure rolling; the outer and inner circles alone would give -1.5 % and +2.6 %
SPIN_RANGE = 0.15  # about pure rolling; 6 % seen
NOTICED_RAD_S2 = 1e-3  # rounding leaves 1e-9; the lightest rolling contact makes thousands
HALVINGS = 20  # 7e-5 rad/s of a spin: 1.4 um/s of slip, a thousandth of the critical velocity


def rolling_speeds(model: Parameters) -> tuple[float, float]:
    """Cage speed and roller spin of pure rolling at the middle circle [rad/s].

    Cage speed (1 - d cos(alpha) / D) / 2 of the shaft (Randall 2011, sect. 2.2.3) and the spin that brings the
    outer contact to rest, at time zero.
    """
    pitch_radius = model.centre_distance * model.tilt_cosine
    shaft = shaft_motion(0.0, model.drive)[0]
    cage = shaft / 2 * (1 - model.law.roller_radius * model.tilt_cosine / pitch_radius)
    return cage, -cage * pitch_radius / model.law.roller_radius


def balance_friction(model: Parameters, state: FloatArray) -> FloatArray:
    """`state` with the cage speed and roller spins at which friction balances on each roller and on the cage.

    The three circles of a contact have different rolling radii and cannot all roll, so friction decides. A spin
    changes its own roller's torque alone and lowers it, a faster cage lowers the cage's; so bisections, the spins'
    within the cage's. A roller without traction turns like the median of the others; a cage that its rollers do not
    drive keeps the speed of pure rolling, and so do they. All other velocities are set to zero; the displacements stay.
    """
    cage, _ = rolling_speeds(model)
    width = abs(cage) * CAGE_RANGE

    def cage_acceleration(speed: FloatArray) -> FloatArray:
        y = _spun(model, state, float(speed[0]))
        return rates(model, 0.0, y).rate[state_layout(model).shaft_cage_rate]

    (balanced,) = _falling_root(cage_acceleration, np.array([cage - width]), np.array([cage + width]))
    return _spun(model, state, float(balanced))


def _spun(model: Parameters, state: FloatArray, cage: float) -> FloatArray:
    """`state` at this cage speed, the rollers turning so that friction has no torque about their axes."""
    layout = state_layout(model)
    spins = layout.spin
    y = state.copy()
    y[layout.half :] = 0.0
    y[layout.shaft_cage_rate] = cage

    def spin_acceleration(spin: FloatArray) -> FloatArray:
        y[spins] = spin
        return rates(model, 0.0, y).rate[spins]

    rolling = np.full(layout.rollers, -cage * model.centre_distance * model.tilt_cosine / model.law.roller_radius)
    width = np.abs(rolling) * SPIN_RANGE
    y[spins] = _falling_root(spin_acceleration, rolling - width, rolling + width)
    return y


def _falling_root(f: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where each component of a falling `f` passes zero; where one does not, the median of the others.

    If none passes zero between `low` and `high`, their middle.
    """
    middle = (low + high) / 2
    passes = (f(low) > NOTICED_RAD_S2) & (f(high) < -NOTICED_RAD_S2)
    if not passes.any():
        return middle
    for _ in range(HALVINGS):
        trial = (low + high) / 2
        rising = f(trial) > 0
        low, high = np.where(rising, trial, low), np.where(rising, high, trial)
    found = (low + high) / 2
    return np.where(passes, found, np.median(found[passes]))
