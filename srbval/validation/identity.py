"""Whether the peak found in a line's window is the line: the window alone does not say so."""

import math

import scipy.special

# Standard deviation of a line's deviation from kinematics by slip, as a share of it. Stated, not fitted: the rig's
# race lines lie 0.04 to 0.24 % off.
SLIP_SPREAD = 1.5e-3


def identity_probability(deviation: float, uncertainty: float, half_window: float, alien_chance: float) -> float:
    """Probability that a peak `deviation` (relative) from its expected place is the line, not another's.

    The line's deviation is normal with `SLIP_SPREAD` and the standard `uncertainty` of reading and speed, within the
    window; what is not the line, the outlier part, is uniform over the `half_window` (all relative)::

        odds = [N(deviation; 0, SLIP_SPREAD^2 + uncertainty^2) / share within the window] 2 half_window / B(p)

    with B(p) = -e p ln p, the least Bayes factor in favour of an alien peak that an alien one's chance p to be as
    strong leaves (Sellke, Bayarri & Berger 2001, Am. Stat. 55, 62, quoted from memory, not checked; 1 from p = 1/e),
    p being `alien_chance`. Line and alien peak are as likely before.
    """
    spread = math.hypot(SLIP_SPREAD, uncertainty)
    within = math.erf(half_window / spread / math.sqrt(2))
    density = math.exp(-((deviation / spread) ** 2) / 2) / (spread * math.sqrt(2 * math.pi)) / within
    chance = max(alien_chance, 1e-300)
    against = -math.e * chance * math.log(chance) if chance < 1 / math.e else 1.0
    return float(scipy.special.expit(math.log(max(density * 2 * half_window, 1e-300)) - math.log(against)))
