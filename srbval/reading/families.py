"""Lines of a bearing with their harmonics and sidebands (families), and frequencies at which it has no line."""

import math
from dataclasses import dataclass

import numpy as np
import scipy.special
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, LARGEST_SLIP, Bearing
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import NORMAL_95, LineReading, Periodogram
from srbval.signal.comb import HARMONICS
from srbval.signal.false_alarm import APART, MIN_PLACEBOS, fundamentals, rank_among_placebos

OWN_SIDEBANDS = 3  # sidebands that belong to a found line when a weaker line is read
PLACEBO_REACH = 2.0  # placebos are drawn up to this factor from a family's frequency, an octave to either side
# A weaker line at one of these ratios of a stronger line's frequency is taken as part of it.
SIMPLE_RATIOS = [(up, down) for up in range(1, 5) for down in range(1, 5) if math.gcd(up, down) == 1]
# Scale and degrees of freedom of Student's t for the relative deviation of a line from kinematics by slip. Stated, not
# estimated. A normal prior would pass only the strongest lines of cages that slip by half a per cent; fewer degrees of
# freedom would pass strong lines of other sources at the window's edge, six scales off (the rig's H 877).
SLIP_SPREAD, SLIP_FREEDOM = 1.5e-3, 10
# Combs of healthy bearings are exponentially rare: the log likelihood ratio of a fault is the slope times the excess of
# a comb over a typical comb, minus the onset. Both values have the greatest mean log score by excess alone on 218
# readings of known state of 7 rigs, with equal weights of all rigs of a class.
LOG_RATIO_SLOPE, LOG_RATIO_ONSET = 1.35, 4.42


@dataclass(frozen=True, kw_only=True)
class Family:
    """Line of one part of the bearing at a shaft speed, with its harmonics and with sidebands `sideband_hz` apart."""

    name: str
    kinematic_hz: float
    sideband_hz: float = 0.0
    sideband_name: str = ""

    def mask(self, record: Periodogram, reading: LineReading) -> Periodogram:
        """Mask the harmonics and sidebands of the line in `record` at the frequency at which it was read."""
        number = np.arange(1, math.floor(record.limit_hz / reading.found_hz) + 1)[:, None]
        side = np.arange(-OWN_SIDEBANDS, OWN_SIDEBANDS + 1)[None, :] * (self.sideband_hz > 0)
        centre = number * reading.found_hz + side * self.sideband_hz
        width = np.broadcast_to(number * reading.ci95_hz, centre.shape)
        return record.masking(centre.ravel(), width.ravel())


def window_share(bearing: Bearing, speed: ShaftSpeed) -> float:
    """Half width of a search window as a share of the line's frequency: largest slip, and error of a measured speed."""
    return bearing.largest_slip + (0.0 if speed.source is SpeedSource.NOMINAL else speed.ci95_hz / speed.value_hz)


def highest_line_hz(bearing: Bearing, shaft_hz: float) -> float:
    """Highest frequency of the harmonics and sidebands that are read for the lines of a bearing [Hz]."""
    highest = max(fault.line_order(bearing.orders) for fault in DEFECTS)
    return (HARMONICS * (1 + bearing.largest_slip) * highest + OWN_SIDEBANDS) * shaft_hz


def families_of(bearing: Bearing, shaft_hz: float) -> tuple[Family, ...]:
    """Families (lines, harmonics, sidebands) of the races, the rollers and, last, the cage at a shaft speed [Hz]."""
    orders = bearing.orders
    faults = (
        Family(
            name=fault.line or "",
            kinematic_hz=fault.line_order(orders) * shaft_hz,
            sideband_hz=fault.sideband_order(orders) * shaft_hz,
            sideband_name=fault.sidebands or "",
        )
        for fault in DEFECTS
    )
    return (*faults, Family(name="FTF", kinematic_hz=orders.ftf * shaft_hz))


def rank_line(
    family: Family,
    reading: LineReading,
    record: Periodogram,
    families: tuple[Family, ...],
    speed: ShaftSpeed,
    scale: float = 1.0,
    combs: int = MIN_PLACEBOS,
) -> tuple[float, float] | None:
    """Rank a line with its harmonics among `combs` mixed placebos within an octave, and among whole placebos.

    `reading` is the result of the search for the line at `scale` times the kinematic frequency of its `family`.
    `families` are all lines of the bearing. None if there are too few frequencies without a line.
    """
    centre, harmonics = scale * family.kinematic_hz, len(reading.snr)
    relative = reading.half_window_hz / centre
    highest = min(PLACEBO_REACH * centre, record.limit_hz / harmonics / (1 + relative))
    placebo_hz = fundamentals(centre / PLACEBO_REACH, highest, relative)
    placebo_hz = placebo_hz[is_placebo_order(placebo_hz, relative, families, speed, scale)]
    return rank_among_placebos(record, centre, reading.half_window_hz, harmonics, placebo_hz, combs=combs)


def is_placebo_order(
    candidates_hz: FloatArray, relative: float, families: tuple[Family, ...], speed: ShaftSpeed, scale: float = 1.0
) -> NDArray[np.bool_]:
    """True for `candidates_hz` [n] near no shaft harmonic, no sideband and no simple multiple (1, 3/2, ...) of a line.

    Lines are expected at `scale` times their frequencies at `speed`. Near means within `APART` times `relative` times
    the frequency of the line; `relative` is the half width of a search window as a share of the line's frequency.
    """
    ratios = np.outer([f.kinematic_hz for f in families], [up / down for up, down in SIMPLE_RATIOS])
    sides = np.arange(-OWN_SIDEBANDS, OWN_SIDEBANDS + 1)
    sidebands = np.array([f.kinematic_hz + k * f.sideband_hz for f in families for k in sides])
    meant = np.sort(scale * np.concatenate((ratios.ravel(), sidebands[sidebands > 0])))
    above = np.clip(np.searchsorted(meant, candidates_hz), 1, meant.size - 1)
    near = np.minimum(*(np.abs(candidates_hz / meant[above - side] - 1) for side in (0, 1))) < APART * relative
    order = candidates_hz / (scale * speed.value_hz)
    near |= np.abs(order - np.rint(order)) < (APART * relative + speed.ci95_hz / speed.value_hz) * order
    return np.asarray(~near)


def identity_probability(reading: LineReading, centre_hz: float, speed_ci95: float, largest_slip: float) -> float:
    """Probability that the peak of `reading`, searched about `centre_hz`, is the bearing's line, not another source's.

    d is the distance of the peak from `centre_hz`, w the half width of the search window, both as shares of
    `centre_hz`. The odds that the peak is the line are t(d / s) 2 w / (s F B)::

        t: Student's density of d / s, if the peak is the line
        s: root sum of squares of `SLIP_SPREAD`, (`largest_slip` - `LARGEST_SLIP`) / 2, and the relative standard
           uncertainties of the peak's frequency and of the shaft speed, `speed_ci95` / 1.96
        F: probability that the line is inside the window
        B: least Bayes factor for another source, -e p ln p for p < 1/e, otherwise 1, in which p is the probability of
           so strong a peak of another source, by the rank among placebos or else by noise alone (Sellke, Bayarri &
           Berger 2001, Am. Stat. 55, 62, quoted from memory, not checked); such a peak is equally probable everywhere
           in the window
    """
    window = reading.half_window_hz / centre_hz
    more = max(0.0, largest_slip - LARGEST_SLIP) / 2
    spread = math.hypot(SLIP_SPREAD, more, reading.ci95_hz / reading.found_hz / NORMAL_95, speed_ci95 / NORMAL_95)
    off, half = (reading.found_hz / centre_hz - 1) / spread, SLIP_FREEDOM / 2
    within = 2 * float(scipy.special.stdtr(SLIP_FREEDOM, window / spread)) - 1
    log_student = math.lgamma(half + 0.5) - math.lgamma(half) - math.log(2 * math.pi * half) / 2
    log_student -= (half + 0.5) * math.log1p(off**2 / SLIP_FREEDOM)
    log_place = math.log(2 * window / spread / within) + log_student
    other = reading.noise_false_alarm if reading.placebo_false_alarm is None else reading.placebo_false_alarm
    chance = min(max(other, 1e-300), 1 / math.e)
    return float(scipy.special.expit(log_place - math.log(-math.e * chance * math.log(chance))))
