"""How a slice gives way, and what friction does over it: closed forms of the kernels against numerical quadrature.

Reason: the kernels use polynomials and a root in single precision with a correction; a wrong coefficient would bend
every result a little. Source: the laws themselves, q = k e^(10/9) over a slice whose penetration runs from one end to
the other, and eq. (19), integrated with SciPy.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from srbval.models.full.contact_kernel import law_of_point
from srbval.models.full.slices_kernel import friction_of_slice, law_at_speed, slice_spring
from tests.verification.harness import paper_scene
from tests.verification.slices_reference import slices_model

STIFFNESS = 3e12  # N/m^(10/9), a slice of some 3 mm
DEPTHS_M = (-4.9e-5, -3e-6, -4e-8, 0.0, 1e-7, 2e-6, 1.5e-5, 8e-5, 5e-4)
SPREADS_M = (1e-8, 2e-7, 5e-6, 1e-4)
# The kernels' polynomials: force to 8e-5, slope to 2e-3, energy to 2e-5, middle to 2e-4 of the touched length; the
# ninth root adds 2e-6.
FORCE, SLOPE, ENERGY, MIDDLE = 1e-4, 2.5e-3, 3e-5, 3e-4
UNTOUCHED_N = 1e-15
POINTS = 20_000
MEAN = 1e-8  # quadrature's own; the kernel adds LEAST_SLIP = 1e-9 m/s to slips of 1e-5 and more
SLIPS_M_S = (1e-5, 3e-4, 8e-4, 1.2e-3, 2e-3, 0.1)
RANGES_M_S = (1e-5, 2e-4, 9e-4, 1.6e-3, 0.05)
# Over the curvature of the gap: how far the line that stands for it is off, of the force at a depth of the spread. 4 is
# the slice in the middle of a contact that is no longer than that: it comes into contact at a corner of the line.
BENT = {0.5: 2e-3, 1.0: 4e-3, 2.0: 1.2e-2, 4.0: 0.13}
BENT_WHOLE = 4e-3  # the same, of slices that touch on all their width
FLAT, LEAST_M = 0.0, 1e-9
SAME_SPEED = 2e-2  # of the critical velocity: rolling speed at the races' middles, without slip


def touched(depth: float, spread: float) -> tuple[float, float]:
    """Ends of the part of a slice that touches, in widths from its middle; penetration is depth + spread x."""
    return max(-0.5, -depth / spread), 0.5


def integral(depth: float, spread: float, power: float, arm: int = 0) -> float:
    """Integral over a slice of its penetration's power, times (x - its lower end)^arm."""
    low, high = touched(depth, spread)
    if low >= high:
        return 0.0
    whole, _ = quad(
        lambda x: max(depth + spread * x, 0.0) ** power * (x - low) ** arm, low, high, epsabs=0.0, epsrel=1e-11
    )
    return float(whole)


@pytest.mark.parametrize("spread", SPREADS_M)
@pytest.mark.parametrize("depth", DEPTHS_M)
def test_spring_of_a_slice(depth, spread):
    force, slope, twice_energy, part, off = slice_spring(STIFFNESS, depth, spread, FLAT, LEAST_M)
    low, high = touched(depth, spread)
    expected = STIFFNESS * integral(depth, spread, 10 / 9)
    if expected == 0:
        assert 0 <= force < UNTOUCHED_N
        assert 0 <= twice_energy < UNTOUCHED_N
        return
    assert force == pytest.approx(expected, rel=FORCE)
    assert slope == pytest.approx(10 / 9 * STIFFNESS * integral(depth, spread, 1 / 9), rel=SLOPE)
    assert twice_energy / 2 == pytest.approx(9 / 19 * STIFFNESS * integral(depth, spread, 19 / 9), rel=ENERGY)
    assert part == pytest.approx(high - low)
    centroid = low + STIFFNESS * integral(depth, spread, 10 / 9, arm=1) / expected
    assert off == pytest.approx(centroid, abs=MIDDLE * (high - low))
    assert centroid >= -MIDDLE  # the deeper end bears more


@pytest.mark.parametrize("bent", BENT)
@pytest.mark.parametrize("share", [-0.4, -0.25, 0.0, 0.25, 0.5, 1.0, 3.0])
def test_a_slice_follows_the_bent_gap(share, bent):
    """Penetration depth + spread x - bend (x^2 / 2 - 1 / 24), x in widths from the middle; depth is its mean."""
    spread = 5e-6
    depth, bend = share * spread, bent * spread
    x = (np.arange(POINTS) + 0.5) / POINTS - 0.5
    penetration = np.maximum(depth + spread * x - bend * (x**2 / 2 - 1 / 24), 0.0)
    force = slice_spring(STIFFNESS, depth, spread, bend, bend / 4)[0]
    expected = STIFFNESS * float((penetration ** (10 / 9)).mean())
    limit = BENT_WHOLE if penetration.min() > 0 else BENT[bent]
    assert force == pytest.approx(expected, abs=limit * STIFFNESS * spread ** (10 / 9))


def coefficient(slip: float, static: float, dynamic: float, critical: float) -> float:
    """Eq. (19)."""
    size = np.interp(abs(slip), [0, critical, 1.5 * critical], [0, static, dynamic])
    return float(math.copysign(size, slip))


@pytest.mark.parametrize("static", [0.7, 0.5])
@pytest.mark.parametrize("more", RANGES_M_S)
@pytest.mark.parametrize("slip", SLIPS_M_S)
def test_friction_of_a_slice(slip, more, static):
    """Mean of eq. (19) over slips from `slip` less `more` to `slip` and `more`, over the slip in the middle."""
    contact = {"static_friction": static, "dynamic_friction": 0.5, "critical_velocity": "1 mm/s"}
    law = law_of_point(slices_model(paper_scene(contact=contact)).law)
    kinks = [side * size for side in (-1, 1) for size in (0.0, 1e-3, 1.5e-3) if abs(side * size - slip) < more]
    whole, _ = quad(
        coefficient, slip - more, slip + more, args=(static, 0.5, 1e-3), points=sorted(set(kinks)) or None, epsrel=1e-10
    )
    found = friction_of_slice(law, slip, more)
    assert found > 0  # against the slip
    assert found * slip == pytest.approx(whole / (2 * more), rel=MEAN, abs=MEAN)


@pytest.mark.parametrize("shaft_rad_s", [35.5, 90.0, -90.0])
def test_lubricated_friction_grows_with_the_slide_to_roll_ratio(shaft_rad_s):
    """Limit at a slip of limit / slope of the rolling speed: half of race's and roller's surface speeds, their sum."""
    oil = {"traction": "lubricated", "traction_slope": 4.0, "traction_limit": 0.06}
    model = slices_model(paper_scene(line_contact=oil))
    cage = 0.4306 * shaft_rad_s
    law = law_at_speed(model.law, model.slices, cage, shaft_rad_s)
    outer = model.centre_distance + model.law.roller_radius
    rolling = abs(cage) * outer * model.tilt_cosine  # of both surfaces in the outer contact, seen from the cage
    assert law.critical_velocity == pytest.approx(0.06 / 4.0 * rolling, rel=SAME_SPEED)
    point = law_of_point(law)
    low, high = (friction_of_slice(point, slip, 1e-9) * slip for slip in (0.1 * law.critical_velocity, 1.0))
    assert low == pytest.approx(0.006, rel=1e-3)
    assert high == pytest.approx(0.06, rel=1e-3)
