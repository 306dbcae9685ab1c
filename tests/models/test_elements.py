"""Balls and cylindrical rollers between their races: Hertz's contact, the load zone, defects, and lines of runs."""

import math
from dataclasses import replace

import numpy as np
import pytest

import srbval
from srbval import ConfigurationError, load_bearing
from srbval.models.planar.contacts import HIGHEST_SHARE, POISSON, YOUNG_N_M2, Ellipse, element_slot, ellipse
from srbval.models.planar.ring import make_ring
from srbval.models.simulate import simulate_to_file
from srbval.scene import DefectShape

INNER_6206 = (2 / 9.525e-3 / (1 - 9.525 / 46), (2 - 9.525 / 4.89) / 9.525e-3)  # groove 4.89 mm, pitch 46 mm
INTEGRALS = 1e-3  # of displacements by quadrature
STRIBECK = 0.01  # of the largest load: the rounded constants 4.37 and 4.08
GAUSS = 200


def displacement_m(e: Ellipse, force_n: float, x: float) -> float:
    """Approach of two half-spaces at `x` across the race under Hertz's pressure, by Boussinesq's integral.

    In polar coordinates about the point the pressure along a ray is p0 sqrt(c - 2 b r - a r^2): no 1 / r is left.
    """
    a, b = e.across_m * force_n ** (1 / 3), e.along_m * force_n ** (1 / 3)
    peak = 1.5 * force_n / (math.pi * a * b)
    angles = (np.arange(4 * GAUSS) + 0.5) * 2 * math.pi / (4 * GAUSS)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    turn = (nodes + 1) * math.pi / 2  # r = end (1 - cos) / 2: the root at the ellipse's edge is resolved
    total = 0.0
    for c, s in zip(np.cos(angles), np.sin(angles), strict=True):
        qa, qb, qc = (c / a) ** 2 + (s / b) ** 2, x * c / a**2, 1 - (x / a) ** 2
        end = (-qb + math.sqrt(qb**2 + qa * qc)) / qa
        r = end * (1 - np.cos(turn)) / 2
        pressure = np.sqrt(np.maximum(qc - 2 * qb * r - qa * r**2, 0.0))
        total += float((pressure * end * np.sin(turn) / 2 * weights).sum()) * math.pi / 2
    return 2 * (1 - POISSON**2) / (math.pi * YOUNG_N_M2) * peak * total * 2 * math.pi / (4 * GAUSS)


@pytest.mark.parametrize("curvatures", [INNER_6206, (252.0, 20.0), (200.0, 60.0)])
def test_under_hertzs_pressure_half_spaces_take_the_bodies_shape(curvatures):
    """The integral equation itself: the approach in the middle, less the gap's half curvature times x squared."""
    e, force = ellipse(*curvatures), 300.0
    approach = e.approach_m * force ** (2 / 3)
    assert displacement_m(e, force, 0.0) == pytest.approx(approach, rel=INTEGRALS)
    for share in (0.4, 0.8):
        x = share * e.across_m * force ** (1 / 3)
        sunk = approach - curvatures[1] * x**2 / 2
        assert displacement_m(e, force, x) == pytest.approx(sunk, rel=INTEGRALS)


@pytest.mark.parametrize("name", ["skf-6205", "fag-nu2205", "fag-qj212"])
def test_strips_add_up_to_the_contact_law_and_balance_on_both_races(name):
    bearing = load_bearing(name)
    scene = srbval.paper_scene(bearing=name)
    slot = element_slot(scene, bearing.elements)
    power = 1.5 if bearing.elements.shape == "ball" else 10 / 9
    low, high = slot.press(np.array([5e-6, 2e-5]))[0]
    assert math.log(high / low) / math.log(4) == pytest.approx(power, rel=1e-6)
    assert slot.press(np.array([-1e-6]))[0, 0] == 0.0
    if power > 1.2:  # the stiffness of both contacts in series, by the ellipses' own
        each = [ellipse(r.along_1_m, (2 - 1 / 0.52) / bearing.elements.element_diameter_m) for r in slot.races]
        whole = sum(e.approach_m for e in each) ** -1.5
        assert high == pytest.approx(whole * (2e-5 * slot.cosine) ** 1.5 * slot.cosine, rel=1e-6)
    else:  # ISO/TS 16281's constant is that of both contacts of a roller
        length = (bearing.elements.length_m or bearing.elements.element_diameter_m) * 1e3
        assert high == pytest.approx(35948 * length ** (8 / 9) * 0.02 ** (10 / 9), rel=1e-6)


@pytest.mark.parametrize("name", ["skf-6205", "fag-nu2205"])
def test_the_most_loaded_element_carries_stribecks_share(name):
    """4.37 (point) and 4.08 (line) times the load over the number, without clearance: NSK technical report E728g."""
    bearing = load_bearing(name)
    many = replace(bearing, elements=replace(bearing.elements, element_diameter_m=1e-3, rolling_elements=90))
    scene = srbval.paper_scene(bearing=name)
    ring = make_ring(scene, many)
    deepest = -float(ring.balance_m()[1] * math.sin(scene.load.zone_rad))
    share = float(ring.plain.at(np.array([deepest]))[0, 0]) * 90 / scene.load.radial_n
    assert share == pytest.approx(HIGHEST_SHARE[many.elements.shape], rel=STRIBECK)


def test_an_opening_takes_load_and_a_bump_adds_it():
    bearing = load_bearing("skf-6205")
    scene = srbval.paper_scene(bearing="skf-6205", defect={"kind": "outer"})
    slot = element_slot(scene, bearing.elements)
    approach, middle = np.array([[2.5e-5]]), np.array([[0.0, 1e-4, 5e-4]])
    sound = slot.press(approach)[0, 0, 0]
    lost = [
        sound - slot.press(approach, slot.on_race(replace(scene.defect, extent_m=e), race, 1e-4)[0](middle))[0, 0]
        for e in (2e-4, 4e-4, 8e-4)
        for race in (0, 1)
    ]
    for some in lost:
        assert 0 < some[0] < sound
        assert some[0] >= some[1] >= some[2] >= 0
    assert lost[0][0] < lost[2][0] < lost[4][0]
    raised = slot.on_race(replace(scene.defect, height_m=5e-6), 0, 1e-4)[0](middle)
    assert slot.press(approach, raised)[0, 0, 0] > sound


def test_an_inner_defect_has_sidebands_at_the_shaft_and_an_outer_one_has_none():
    heights = {}
    for kind in ("inner", "outer"):
        run = srbval.simulate(srbval.paper_scene(bearing="skf-6205", duration="2 s", defect={"kind": kind}))
        envelope = np.abs(np.fft.rfft(run.acceleration_m_s2[:, 1] ** 2 * np.hanning(run.samples)))
        orders = load_bearing("skf-6205").orders
        line = (orders.bpfi if kind == "inner" else orders.bpfo) * run.scene.shaft_hz
        at = [envelope[round((line + k * run.scene.shaft_hz) * run.seconds) + np.arange(-2, 3)].max() for k in (0, 1)]
        heights[kind] = at[1] / at[0]
    assert heights["inner"] > 0.2
    assert heights["outer"] < 0.02


def test_a_run_file_carries_its_bearing(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'title = "mine"\nsource = "drawing 1"\n[elements]\nrolling_elements = 11\nelement_diameter = "10 mm"\n'
        'pitch_diameter = "60 mm"\ncontact_angle = "0 deg"\nshape = "roller"\nlength = "12 mm"\n',
        encoding="utf-8",
    )
    expected = load_bearing(mine)
    simulate_to_file(srbval.paper_scene(bearing=str(mine), duration="0.2 s"), tmp_path / "run.h5")
    mine.unlink()
    carried = srbval.load_recording(tmp_path / "run.h5").own_bearing
    assert (carried.title, carried.source, carried.rolling_elements) == ("mine", "drawing 1", 11)
    assert carried.orders == expected.orders


@pytest.mark.parametrize(
    ("change", "legal"),
    [({"shape": DefectShape.COSINE}, "'flat' and 'hole'"), ({"shape": DefectShape.FLAT, "extent_m": None}, "0.5 mm")],
)
def test_a_shape_that_strips_do_not_know_is_refused_with_a_legal_one(change, legal):
    scene = srbval.paper_scene(bearing="skf-6205", defect={"kind": "outer"})
    with pytest.raises(ConfigurationError, match=legal):
        srbval.simulate(replace(scene, defect=replace(scene.defect, **change)))
