"""The mass that the scene `rig` gives its box: the reduced mass of box and shaft, computed anew from geometry."""

import math

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.scene import load_scene, rig_inputs

STEEL_KG_M3, STEEL_PA = 7850.0, 2.06e11
BORE_M, BEARING_KG = 0.200, 43.5  # SKF Rolling bearings, 2018, 22240 CCK/W33
BOX_KG = 75.0  # Table 4
RING_HZ = 1100.0  # along the load, of Table 4's box on the contacts' stiffness against a shaft that does not move
ROUNDED_KG, ROUNDED = 1.0, 0.02  # the scene's and the ranges' figures are rounded


def masses() -> tuple[float, float, float]:
    """Of the outer ring, of it with Table 4's box, of the inner ring [kg]."""
    scene, geometry = load_scene("rig"), load_bearing("skf-22240").geometry
    assert geometry is not None
    ring = geometry.outer_ring_mass_kg(STEEL_KG_M3)
    half, arc = geometry.roller_width_m / 2, geometry.raceway_radius_m
    z = np.linspace(-half, half, 2001)  # a barrel: its profile is an arc
    radius = geometry.roller_diameter_m / 2 - arc + np.sqrt(arc**2 - z**2)
    rollers = 2 * geometry.rollers_per_row * STEEL_KG_M3 * float(np.trapezoid(math.pi * radius**2, z))
    return ring, ring + BOX_KG, BEARING_KG - ring - rollers - scene.bodies.cage_mass_kg


def test_the_box_of_the_rig_has_the_reduced_mass_less_the_ring() -> None:
    ring, box, inner = masses()
    stiffness = box * (2 * math.pi * RING_HZ) ** 2
    area, bending = math.pi * BORE_M**2 / 4, STEEL_PA * math.pi * BORE_M**4 / 64
    hz = RING_HZ
    for _ in range(30):  # the shaft's part depends on the frequency, and this on it
        wave = (STEEL_KG_M3 * area * (2 * math.pi * hz) ** 2 / bending) ** 0.25
        shaft = inner + 2 * STEEL_KG_M3 * area / wave
        reduced = box * shaft / (box + shaft)
        hz = math.sqrt(stiffness / reduced) / (2 * math.pi)
    short = inner + STEEL_KG_M3 * area * 0.098
    scene, ranges = load_scene("rig"), {one.key: one for one in rig_inputs()}
    mass, damping = ranges["housing.mass"], ranges["housing.damping"]
    assert scene.housing.mass_kg == pytest.approx(reduced - ring, abs=ROUNDED_KG)
    assert mass.low == pytest.approx(box * short / (box + short) - ring, abs=ROUNDED_KG)
    assert mass.high == BOX_KG
    assert damping.high == pytest.approx(0.07 * 2 * math.sqrt(stiffness * reduced), rel=ROUNDED)
    assert scene.housing.damping_ns_m == damping.high / 2
