"""Whether the peak found in a line's window is the line: the window alone does not say so."""

import math

import scipy.special
from scipy.stats import t

from srbval.bearing import LARGEST_SLIP
from srbval.signal import NORMAL_95, LineReading

# Scale and degrees of freedom of Student's t for a line's deviation from kinematics by slip, as a share of it. Stated,
# not estimated. A normal prior of this scale has no place for cages that slip by half a per cent: it would pass only
# their strongest lines, and whatever is said of the slip of lines passed would be biased towards none. Ten degrees of
# freedom give four scales fifteen times the odds of a normal prior; fewer would pass strong lines of other sources at
# the window's edge, six scales off, as the rig's H 877 has one.
SLIP_SPREAD, SLIP_FREEDOM = 1.5e-3, 10


def identity_probability(
    reading: LineReading, centre_hz: float, speed_ci95: float, other_chance: float, largest_slip: float
) -> float:
    """Probability that the peak of `reading`, looked for about `centre_hz`, is the line and not another source's.

    The line's relative deviation d has Student's t distribution of scale s, s^2 = SLIP_SPREAD^2 + u^2 with the standard
    uncertainty u of reading and speed (`speed_ci95`, relative), within the window; that of what is not the line is
    uniform over its half width w::

        odds = [t(d / s) / s / its share within the window] 2 w / B(p)

    with B(p) = -e p ln p, the least Bayes factor in favour of another source's peak that is left by its chance p to be
    as strong, `other_chance` (Sellke, Bayarri & Berger 2001, Am. Stat. 55, 62, quoted from memory, not checked; 1 from
    p = 1/e). Line and other peak are equally likely before. Where the cage may slip by more than `LARGEST_SLIP`, half
    of the difference to `largest_slip` joins s as a further standard uncertainty.
    """
    window = reading.half_window_hz / centre_hz
    more = max(0.0, largest_slip - LARGEST_SLIP) / 2
    spread = math.hypot(SLIP_SPREAD, more, reading.ci95_hz / reading.found_hz / NORMAL_95, speed_ci95 / NORMAL_95)
    off = (reading.found_hz / centre_hz - 1) / spread
    within = 2 * float(t.cdf(window / spread, SLIP_FREEDOM)) - 1
    log_place = math.log(2 * window / spread / within) + float(t.logpdf(off, SLIP_FREEDOM))
    chance = max(other_chance, 1e-300)
    against = -math.e * chance * math.log(chance) if chance < 1 / math.e else 1.0
    return float(scipy.special.expit(log_place - math.log(against)))
