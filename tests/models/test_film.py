"""Viscosity, films, traction and rolling resistance against other formulations: Grubin's inlet, integrated; SKF's."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from srbval.bearing import load_bearing
from srbval.models import oil
from srbval.models.full.oil_kernel import ASPERITY, ASPERITY_EXPONENT, GAUSS, film_drag, film_on_race
from srbval.models.full.slices_kernel import law_at_speed
from srbval.models.slices import slice_parameters, sliced_contacts
from srbval.scene import load_scene

SCENE = load_scene("rig-oil")
OIL = SCENE.oil
GEOMETRY = load_bearing("skf-22240").geometry
MODEL = slice_parameters(SCENE, GEOMETRY)
SHAPES = [contact.shape for contact in sliced_contacts(SCENE, GEOMETRY)]
RADIUS_M = 0.0172  # reduced, of a roller of the 22240 on the inner race
ROLLING_M_S = (2.45, 6.2)  # at 340 and 859 rpm
LOADS_N_M = (1e5, 3e5, 6e5)
FILM = 0.06  # Grubin's film and Dowson & Toyoda's: seen 0.05 at most
ELLIPTICAL = 0.3  # of a long ellipse's film less than a line's: its oil leaves sideways
ROLLING = 0.05  # Grubin's rolling force at 0.9 GPa and twice Goksem & Hargreaves'
THERMAL = 0.03  # three formulas of shear heating
KERNEL = 0.06  # of the polynomial over the pressure, in the logarithm of the viscosity
CONTACT_LENGTH = 0.03  # of a circular contact, Hertz's


def grubin(rolling_m_s: float, load_n_m: float) -> tuple[float, float]:
    """Film [m] and the integral of (h - h_0) dp [N/m] in the inlet of a Hertzian line contact: A. N. Grubin 1949.

    Reynolds' equation with the gap outside a Hertzian contact and Barus' viscosity; the reduced pressure reaches
    1 / alpha at the contact's edge.
    """
    eta, alpha = OIL.viscosity_pa_s, OIL.pressure_viscosity_1_pa
    half = math.sqrt(4 * load_n_m * RADIUS_M / (math.pi * oil.CONTACT_MODULUS_PA))

    def above(x):
        return half**2 / (2 * RADIUS_M) * (x * np.sqrt(x * x - 1) - np.log(x + np.sqrt(x * x - 1)))

    def rise(s, height):  # x = 1 + s^2, as the pressure rises at the edge
        gap = above(1 + s * s)
        return 12 * eta * rolling_m_s * gap / (gap + height) ** 3 * half * 2 * s

    height = brentq(lambda h: quad(rise, 0, 8, args=(h,), limit=500)[0] - 1 / alpha, 1e-9, 1e-4)
    s = np.linspace(8, 0, 100_001)
    middle, step = (s[1:] + s[:-1]) / 2, s[:-1] - s[1:]
    rises = rise(middle, height) * step
    reduced = np.minimum(np.cumsum(rises) - rises / 2, (1 - 1e-9) / alpha)
    return height, float(np.sum(above(1 + middle**2) * rises / (1 - alpha * reduced)))


@pytest.mark.parametrize("rolling_m_s", ROLLING_M_S)
@pytest.mark.parametrize("load_n_m", LOADS_N_M)
def test_films_are_those_of_grubins_inlet(rolling_m_s, load_n_m):
    expected, _ = grubin(rolling_m_s, load_n_m)
    line = oil.line_film_m(OIL, rolling_m_s, load_n_m, RADIUS_M)
    assert line == pytest.approx(expected, rel=FILM)
    middle, least = oil.elliptical_films_m(OIL, rolling_m_s, load_n_m * 0.03, RADIUS_M, SHAPES[1].across_m)
    assert 1 - ELLIPTICAL < middle / line < 1
    assert 0.7 < least / middle < 0.9  # a horseshoe of three quarters, any text


@pytest.mark.parametrize("rolling_m_s", ROLLING_M_S)
def test_rolling_costs_what_flows_through_grubins_inlet(rolling_m_s):
    """Twice the formula's force: it is that on each surface. At less load the formula is lower, Grubin's is not."""
    _, total = grubin(rolling_m_s, LOADS_N_M[-1])
    own = oil.rolling_force_n(OIL, rolling_m_s, LOADS_N_M[-1], RADIUS_M, 1.0)
    assert 2 * own == pytest.approx(total, rel=ROLLING)
    couple = SHAPES[1].rolling_couple_nm(OIL, rolling_m_s / SHAPES[1].along_m, 1e4, 0.03)
    force = oil.rolling_force_n(OIL, rolling_m_s, 1e4, SHAPES[1].along_m, 0.03)
    assert couple * rolling_m_s / SHAPES[1].along_m == pytest.approx(2 * force * rolling_m_s, rel=1e-12)


def test_shear_heating_of_the_inlet_by_three_formulas():
    """Gupta et al. 1992 (quoted from memory) and SKF's factor of the rolling moment."""
    loading = OIL.thinning_1_k * OIL.viscosity_pa_s * ROLLING_M_S[1] ** 2 / OIL.conductivity_w_mk
    gupta = (1 - 13.2 * 0.0049 * loading**0.42) / (1 + 0.213 * loading**0.64)
    skf = 1 / (1 + 1.84e-9 * (859 * 280) ** 1.28 * OIL.kinematic_mm2_s() ** 0.64)
    assert oil.thermal_factor(OIL, ROLLING_M_S[1]) == pytest.approx(gupta, abs=THERMAL)
    assert oil.thermal_factor(OIL, ROLLING_M_S[1]) == pytest.approx(skf, abs=THERMAL)


def test_viscosity_by_class_and_temperature():
    """ASTM D341 passes through both points; its slope is the derivative; Roelands' law has the given coefficient."""
    for temperature, expected in ((40, 150), (100, 14.7)):
        assert replace(OIL, temperature_c=temperature).kinematic_mm2_s() == pytest.approx(expected, rel=1e-12)
    assert OIL.kinematic_mm2_s() == pytest.approx(57, abs=1)  # at 60 degrees C, a maker's chart of VG 150
    warm, cool = (replace(OIL, temperature_c=60 + d).viscosity_pa_s for d in (0.01, -0.01))
    assert OIL.thinning_1_k == pytest.approx(math.log(cool / warm) / 0.02, rel=1e-4)
    assert OIL.log_thickening(1e4) / 1e4 == pytest.approx(OIL.pressure_viscosity_1_pa, rel=1e-3)


def test_length_of_a_contact_is_hertzs():
    """Of a circle: a = (3 Q R / (4 E*))^(1/3), R that of both directions, E* the contact modulus of two bodies."""
    circle = oil.ContactShape(1 / RADIUS_M, 1 / RADIUS_M, 1.0)
    expected = 2 * (3 * 1e3 * RADIUS_M / (4 * oil.CONTACT_MODULUS_PA)) ** (1 / 3)
    assert circle.length_m(1e3) == pytest.approx(expected, rel=CONTACT_LENGTH)


@pytest.mark.parametrize("race", [0, 1])
@pytest.mark.parametrize("pressure_gpa", [0.1, 0.3, 0.6, 0.9, 1.5])
@pytest.mark.parametrize("slip_m_s", [1e-4, 1e-2, 0.1, 3.0])
def test_a_slice_shears_as_eyrings_law_says(race, pressure_gpa, slip_m_s):
    """The kernel's friction in single precision, from load and width, against the law in closed form."""
    cage, shaft = 38.75, 90.0
    slices, shape = MODEL.slices, SHAPES[race]
    law = law_at_speed(MODEL.law, slices, cage, shaft)
    rolling = 0.5 * (slices.outer_radius * cage + slices.inner_radius * (shaft - cage))
    load = oil.line_load_n_m(pressure_gpa * 1e9, shape.along_m)
    height = oil.line_film_m(OIL, rolling, load, shape.along_m) * oil.thermal_factor(OIL, rolling)
    pressure_pa, eyring_pa = pressure_gpa * 1e9, OIL.eyring_stress_pa
    viscosity = OIL.viscosity_pa_s * math.exp(OIL.log_thickening(pressure_pa))
    expected = eyring_pa / pressure_pa * math.asinh(viscosity * slip_m_s / (height * eyring_pa))
    shear = film_on_race(slices.film, law._replace(dynamic_friction=0.0), race)
    found = film_drag(shear, 0.5 / shape.along_m, load * 3e-3, 3e-3, slip_m_s**2, 0.0) * slip_m_s / (load * 3e-3)
    newtonian = KERNEL * expected + 2e-5 * OIL.eyring_stress_pa / (pressure_gpa * 1e9)
    assert found == pytest.approx(expected, abs=float(newtonian) + 0.05 * float(expected))
    # The slips at the slice's two points are three times this slip, and this slip the other way.
    at_ends = film_drag(shear, 0.5 / shape.along_m, load * 3e-3, 3e-3, slip_m_s**2, 2 * slip_m_s / GAUSS)
    faster = film_drag(shear, 0.5 / shape.along_m, load * 3e-3, 3e-3, 9 * slip_m_s**2, 0.0)
    assert at_ends * slip_m_s == pytest.approx((3 * faster * slip_m_s - found * load * 3e-3) / 2, rel=0.05)


def test_thin_films_leave_a_share_to_asperities():
    """At rest all, at a lambda of 3 a thousandth; their friction is then the boundary's."""
    still = law_at_speed(MODEL.law, MODEL.slices, 0.0, 1e-6)
    assert still.dynamic_friction == pytest.approx(OIL.boundary_friction, rel=0.01)
    fast = law_at_speed(MODEL.law, MODEL.slices, 38.75, 90.0)
    assert fast.static_friction == pytest.approx(1.0, abs=1e-3)
    assert math.exp(-ASPERITY * 3.0**ASPERITY_EXPONENT) == pytest.approx(1e-3, rel=0.3)
    shear = film_on_race(MODEL.slices.film, still, 0)
    assert film_drag(shear, 22.0, 1e3, 3e-3, 1.0, 0.0) == pytest.approx(1e3 * OIL.boundary_friction, rel=0.02)
