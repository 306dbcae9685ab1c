"""Uncertainty of the cage ratio of a ball or roller bearing that is known by its published dimensions.

The ratio is (1 - s) (1 - d / D cos(alpha)) / 2 with d and D the diameters of elements and pitch circle, contact angle
alpha and slip s, by which the cage lags (as in `identity`). A deep groove ball bearing has no contact angle under a
radial load alone, and up to the free one, cos(alpha) = 1 - P / (2 A), where it is pushed along its axis: diametral
clearance P, A = (f_o + f_i - 1) d from groove centre to groove centre (Harris & Kotzalas, Essential Concepts of Bearing
Technology, 2006, chapter 2; quoted from memory, compared with a maker's table in the tests). A stated angle is kept.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import ElementShape, RollingElements
from srbval.reading.families import SLIP_FREEDOM, SLIP_SPREAD
from srbval.signal import NORMAL_95
from srbval.storage.tables import read_toml

RANGES = read_toml(Path(__file__).with_name("cage_inputs.toml"))


@dataclass(frozen=True, kw_only=True)
class CageInputs:
    """The cage ratio over that of the published dimensions without slip: mean and 95 % half width, relative.

    `angle_deg`: largest contact angle drawn.
    """

    shift: float
    ci95: float
    angle_deg: float


def free_contact_angle_rad(clearance_m: FloatArray, groove_sum: FloatArray, ball_m: FloatArray) -> FloatArray:
    """Contact angle at which the diametral clearance is taken up; `groove_sum` is f_o + f_i."""
    return np.arccos(np.maximum(0.0, 1 - clearance_m / (2 * (groove_sum - 1) * ball_m)))


def largest_clearance_m(elements: RollingElements) -> float:
    """Largest clearance of class C3 for the bore that the dimensions imply; proportional beyond the table."""
    table = RANGES["largest_clearance"]
    bore_mm = 1e3 * (elements.pitch_diameter_m - RANGES["ball_diameters_to_bore"] * elements.element_diameter_m)
    return 1e-6 * next((um for most_mm, um in table if bore_mm <= most_mm), table[-1][1] * bore_mm / table[-1][0])


@cache
def cage_inputs(elements: RollingElements) -> CageInputs:
    """Shift and uncertainty by all uncertain dimensions, drawn together (Latin hypercube, always the same draws)."""
    from scipy.stats import t
    from scipy.stats.qmc import LatinHypercube

    u = LatinHypercube(d=7, rng=np.random.default_rng(0)).random(RANGES["draws"]).T
    rounding, (low, high) = RANGES["rounding_m"], RANGES["groove"]
    ball_m = elements.element_diameter_m + rounding * (2 * u[0] - 1)
    pitch_m = elements.pitch_diameter_m + rounding * (2 * u[1] - 1)
    angle = np.full(u.shape[1], elements.contact_angle_rad)
    if elements.shape is ElementShape.BALL and elements.contact_angle_rad == 0:
        grooves = 2 * low + (high - low) * (u[2] + u[3])
        angle = u[4] * free_contact_angle_rad(u[5] * largest_clearance_m(elements), grooves, ball_m)
    slip = np.abs(t.ppf((1 + u[6]) / 2, SLIP_FREEDOM)) * SLIP_SPREAD
    ratio = (1 - slip) * (1 - ball_m / pitch_m * np.cos(angle)) / 2 / elements.orders.ftf
    return CageInputs(
        shift=float(ratio.mean()) - 1, ci95=NORMAL_95 * float(ratio.std()), angle_deg=float(np.degrees(angle.max()))
    )
