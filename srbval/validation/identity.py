"""Whether the peak found in a line's window is the line: the window alone does not say so."""

import math

import scipy.special

from srbval.signal import NORMAL_95, LineReading

# Standard deviation of a line's deviation from kinematics by slip, as a share of it. Stated, not fitted.
SLIP_SPREAD = 1.5e-3


def identity_probability(reading: LineReading, centre_hz: float, speed_ci95: float, alien_chance: float) -> float:
    """Probability that the peak of `reading`, looked for about `centre_hz`, is the line and not another's.

    The line's relative deviation d is normal with `SLIP_SPREAD` and the standard uncertainty u of reading and speed
    (`speed_ci95`, relative) within the window; that of what is not the line is uniform over its half width w::

        odds = [N(d; 0, SLIP_SPREAD^2 + u^2) / its share within the window] 2 w / B(p)

    with B(p) = -e p ln p, the least Bayes factor in favour of an alien peak that its chance p to be as strong leaves
    (Sellke, Bayarri & Berger 2001, Am. Stat. 55, 62, quoted from memory, not checked; 1 from p = 1/e), p being
    `alien_chance`. Line and alien peak are as likely before.
    """
    window = reading.half_window_hz / centre_hz
    spread = math.hypot(SLIP_SPREAD, reading.ci95_hz / reading.found_hz / NORMAL_95, speed_ci95 / NORMAL_95)
    off = (reading.found_hz / centre_hz - 1) / spread
    within = math.erf(window / spread / math.sqrt(2))
    log_place = math.log(2 * window / (spread * math.sqrt(2 * math.pi)) / within) - off**2 / 2
    chance = max(alien_chance, 1e-300)
    against = -math.e * chance * math.log(chance) if chance < 1 / math.e else 1.0
    return float(scipy.special.expit(log_place - math.log(against)))
