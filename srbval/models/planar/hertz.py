"""Hertz's contact of a ball in a groove: stiffness and extent, by elliptic integrals.

After Harris & Kotzalas, Essential Concepts of Bearing Technology (2006), chapter 6 (quoted from memory; held against
the displacement of a half-space under the pressure found, in ``tests/models/test_elements.py``). With the principal
curvatures A along the race and B across it of the gap, B the smaller, the ratio k of the ellipse's axes follows from

    (A - B) / (A + B) = ((k^2 + 1) E - 2 K) / ((k^2 - 1) E),    K, E complete elliptic integrals of 1 - 1 / k^2.
"""

import math
from dataclasses import dataclass
from functools import cache

YOUNG_N_M2, POISSON = 2.07e11, 0.3  # bearing steel, ISO/TS 16281
FLATTEST = 1e4  # ratio of the axes up to which is searched; grooves of 0.502 give some 40


@dataclass(frozen=True, kw_only=True)
class Ellipse:
    """A contact under 1 N: approach of the bodies [m], half axes across and along the race [m].

    The approach grows with the load to the 2/3, the axes with its cube root.
    """

    approach_m: float
    across_m: float
    along_m: float

    @property
    def stiffness(self) -> float:
        """Force over the approach to the 3/2 [N/m^(3/2)]."""
        return self.approach_m**-1.5


@cache
def ellipse(along_1_m: float, across_1_m: float) -> Ellipse:
    """The contact of two bodies of steel; curvatures of the gap, the sum of both bodies', along and across the race."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    total = along_1_m + across_1_m

    def missing(k: float) -> float:
        m = 1 - 1 / k**2
        return float(((k**2 + 1) * ellipe(m) - 2 * ellipk(m)) / ((k**2 - 1) * ellipe(m)))

    share = (along_1_m - across_1_m) / total
    k = float(brentq(lambda k: missing(k) - share, 1 + 1e-6, FLATTEST)) if share > 1e-9 else 1.0
    first, second = float(ellipk(1 - 1 / k**2)), float(ellipe(1 - 1 / k**2))
    size = (3 / total * (1 - POISSON**2) / YOUNG_N_M2) ** (1 / 3)  # of two equal materials, under 1 N
    return Ellipse(
        across_m=size * (2 * k**2 * second / math.pi) ** (1 / 3),
        along_m=size * (2 * second / (math.pi * k)) ** (1 / 3),
        approach_m=size**2 * total / math.pi * first * (math.pi / (2 * k**2 * second)) ** (1 / 3),
    )
