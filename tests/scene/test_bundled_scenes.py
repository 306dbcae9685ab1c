"""The scenes that are known by name, the ranges of the rig's inputs, and the mass of its box computed from geometry."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError, load_bearing
from srbval.scene import DefectShape, LoadPath, RigInput, Traction, load_scene, paper_scene, rig_inputs
from srbval.scene.read import bundled_table

CLEARANCE_M = 92.5e-6  # the middle of the mounted clearance that the tables allow
# Of the gap at a roller; the scene's play has four digits, and the gap is not quite linear in the ring's displacement.
SAME_GAP = 1e-3
EXACT_RELATIVE = 1e-12  # rounding of a change of units
INPUTS = {one.key: one for one in rig_inputs()}


def keys_of(table: Mapping[str, Any], before: str = "") -> set[str]:
    """Dotted paths of all values of a table."""
    found = set()
    for key, value in table.items():
        found |= keys_of(value, f"{before}{key}.") if isinstance(value, Mapping) else {before + key}
    return found


def test_scenes_by_name():
    assert load_scene("paper") == paper_scene()
    rig = load_scene("rig", {"defect": {"kind": "outer"}})
    assert (rig.model, rig.load.path, rig.load.gravity) == ("slices", LoadPath.BEARING, True)
    assert rig.line_contact.traction is Traction.LUBRICATED
    assert 60 * rig.shaft_hz == pytest.approx(858.94, rel=EXACT_RELATIVE)
    (pit,) = rig.defects
    assert (pit.shape, pit.extent_m, pit.height_m, pit.axial_m) == (DefectShape.HOLE, 2e-3, -5e-4, 0.0)
    assert load_scene("rig").defects == ()
    assert rig.bodies.density_kg_m3 == paper_scene().bodies.density_kg_m3, "missing values are the paper's"


def test_a_file_of_a_scenes_name_needs_its_ending_or_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("rig", "rig.toml"):
        Path(name).write_text('model = "kinematic"\n', encoding="utf-8")
    assert load_scene("rig").model == "slices"
    assert {load_scene(name).model for name in ("rig.toml", "./rig", tmp_path / "rig")} == {"kinematic"}


@pytest.mark.parametrize(
    ("name", "message"),
    [("rigg", "did you mean 'rig'"), ("papers", "did you mean 'paper'"), ("abc", "not known. Known: paper, rig")],
)
def test_unknown_names(name, message):
    with pytest.raises(ConfigurationError, match=message):
        load_scene(name)


def test_the_play_at_a_roller_follows_from_the_rings_clearance():
    """A ring displaced by half its clearance just touches the roller in that direction, and is free by the play."""
    geometry = load_bearing("skf-22240").geometry
    play = load_scene("rig").contact.radial_play_m
    across = geometry.inner_centre_radial_m, geometry.inner_centre_axial_m  # from the outer sphere's centre

    def gap_m(displaced_m: float) -> float:  # between two arcs, along the line through their centres
        return 2 * geometry.raceway_radius_m - math.hypot(across[0] + displaced_m, across[1])

    assert gap_m(0.0) - gap_m(CLEARANCE_M / 2) == pytest.approx(play, rel=SAME_GAP)
    assert gap_m(0.0) == pytest.approx(geometry.zero_play_diameter_m, rel=SAME_GAP)


@pytest.mark.parametrize("key", INPUTS)
def test_each_input_is_the_scenes(key):
    """Its nominal value is the scene's, and every value of its range makes a scene."""
    one = INPUTS[key]
    assert load_scene("rig", one.changes(one.nominal)) == load_scene("rig")
    assert one.low <= one.nominal <= one.high
    for value in (one.low + share * (one.high - one.low) for share in one.shares):
        scene = load_scene("rig", one.changes(value))
        assert (scene == load_scene("rig")) == (value == one.nominal)
    assert one.stands_for
    assert one.source


def test_every_value_of_the_rigs_own_has_a_range_or_a_reason():
    own, reasons = keys_of(bundled_table("rig")), bundled_table("rig_inputs")["no_range"]
    assert own == set(INPUTS) - {"load.direction"} | set(reasons), "besides the direction, which is the paper's"
    assert not set(INPUTS) & set(reasons)
    assert all(reasons.values())


@pytest.mark.parametrize("wrong", [{"low": 2.0}, {"high": 0.5}, {"points": 1}, {"low": 1.0, "high": 1.0}])
def test_a_range_must_hold_its_nominal_value(wrong):
    given: dict[str, Any] = {"low": 0.0, "high": 2.0, "points": 3} | wrong
    with pytest.raises(ConfigurationError, match="must rise"):
        RigInput(key="a", nominal=1.0, stands_for="", source="", **given)


# The mass of the rig's box: the reduced mass of box and shaft.
STEEL_KG_M3, STEEL_PA = 7850.0, 2.06e11
BORE_M, BEARING_KG = 0.200, 43.5  # SKF Rolling bearings, 2018, 22240 CCK/W33
BOX_KG = 75.0  # Table 4
RING_HZ = 1100.0  # along the load, of Table 4's box on the contacts' stiffness against a shaft that does not move
ROUNDED_KG, ROUNDED = 1.0, 0.02  # the scene's and the ranges' figures are rounded


def masses() -> tuple[float, float, float]:
    """Masses of the outer ring, of it with Table 4's box, and of the inner ring [kg]."""
    scene, geometry = load_scene("rig"), load_bearing("skf-22240").geometry
    assert geometry is not None
    ring = geometry.outer_ring_mass_kg(STEEL_KG_M3)
    half, arc = geometry.roller_width_m / 2, geometry.raceway_radius_m
    z = np.linspace(-half, half, 2001)  # a barrel: its profile is an arc
    radius = geometry.roller_diameter_m / 2 - arc + np.sqrt(arc**2 - z**2)
    rollers = 2 * geometry.rollers_per_row * STEEL_KG_M3 * float(np.trapezoid(math.pi * radius**2, z))
    return ring, ring + BOX_KG, BEARING_KG - ring - rollers - scene.bodies.cage_mass_kg


def test_the_box_of_the_rig_has_the_reduced_mass_less_the_ring():
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
