"""Scenes: error messages, bundled scenes, ranges and box of the rig, surfaces of races and rollers."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from srbval import load_bearing
from srbval.cli.arguments import build_parser
from srbval.cli.scene_commands import scene_from_options
from srbval.errors import ConfigurationError
from srbval.models.planar.ring import make_ring
from srbval.models.run import not_validated
from srbval.models.run_file import scene_dict
from srbval.scene import DefectShape, LoadPath, Surface, Traction, load_scene, paper_scene, rig_inputs, with_points
from srbval.scene.read import bundled_table, changes_at
from srbval.scene.surface import RoughnessClass
from srbval.storage.tables import walk_leaves
from tests.verification.harness import parameters

EXACT_RELATIVE = 1e-12  # rounding of a change of units


def test_defaults_are_table_4():
    scene = paper_scene()
    contact, housing = scene.contact, scene.housing
    assert (contact.stiffness_n_m, contact.damping_ns_m, contact.smoothing_width_m) == (5e7, 1e3, 1e-8)
    assert (contact.static_friction, contact.dynamic_friction, contact.points_per_circle) == (0.7, 0.5, 500)
    assert (housing.mass_kg, housing.stiffness_n_m, housing.damping_ns_m) == (75, 5e9, 5e5)
    assert scene.load.radial_n == pytest.approx(124_800)
    assert scene.solver.step_s == pytest.approx(1 / 61_440, rel=EXACT_RELATIVE / 1e3)
    assert 60 * scene.shaft_hz == pytest.approx(710, rel=EXACT_RELATIVE)


PATH = {"frequency_hz": [1e3, 1258.9254, 1584.8932], "load": [2.0, 0.5, 1.0], "cross": [6.0, 1.5, 3.0], "source": "t"}
REFUSED = [
    ({"shaft_sped": "710 rpm"}, "did you mean 'shaft_speed'"),
    ({"contact": {"stiffness": "-1 N/m"}}, "contact stiffness_n_m = -1 must be above 0"),
    ({"contact": {"static_friction": 0.1}}, "must not be below"),
    ({"defect": {"circle": 4}}, "at least 1 and at most 3"),
    ({"defect": {"height": "5 mm"}}, "at least -0.001 and at most 0.001"),
    ({"duration": "1 us"}, "shorter than one output interval"),
    ({"speed_profile": {"time": ["0 s", "5 s"], "speed": ["1 rpm", "2 rpm"]}}, "covers 0 to 5 s; the run records 0"),
    ({"speed_profile": {"time_s": [0.0, float("nan")], "speed": ["1 rpm", "2 rpm"]}}, "not finite"),
    ({"speed_profile": {"time": ["0 s", "20 s"], "speed": ["1 rpm"]}}, "one value for each"),
    (
        {"speed_profile": {"time": ["0 s", "20 s"], "speed": ["1 rpm", "-2 rpm"]}},
        "speed_rad_s = -0.2.* must be at least 0",
    ),
    ({"defect": {"kind": "outer", "refinement": 4}}, "needs an extent"),
    ({"defect": {"kind": "outer", "extent": "80 mm"}}, "at most 0.05"),
    ({"detail_rate": "300 Hz"}, "must divide"),
    ({"duration_s": 1e12}, "1e\\+12"),
    ({"contact": {"points_per_circle": 10**9}}, "1000000000.*100000"),
    ({"further_defects": [{"kind": "outer"}] * 10**6}, "100000[01].*20"),
    ({"seed": -1}, "seed = -1"),
    ({"surface": {}}, "no wave height: state roughness_class"),
    ({"surface": {"outer_waviness": "-1 um"}}, "at least 0 and at most 0.0001"),
    ({"surface": {"roughness_class": "N13"}}, "'N13' is not known"),
    ({"surface": {"roughness_class": "N3", "exponent": 3}}, "exponent = 3 must be at least 0 and at most 2"),
    ({"surface": {"roughness_class": "N3", "shortest": "2 mm", "longest": "1 mm"}}, "must be below longest"),
    ({"surface": {"roughness_class": "N3", "shortest": "1 um"}}, "shortest_m = 1e-06 must be at least 0.0001"),
    ({"surface": {"race_waviness": "1 um"}}, "unknown key 'race_waviness'"),
    ({"sensor_path": PATH | {"load": [0.0, 1.0, 1.0]}}, "load"),
    ({"sensor_path": PATH | {"cross": [1.0, 1.0]}}, "3 load, 2 cross"),
    ({"sensor_path": PATH | {"u_db": [1.0]}}, "1 u_db"),
    ({"sensor_path": PATH | {"u_db": [-1.0, 1.0, 1.0]}}, "u_db"),
    ({"sensor_path": PATH | {"frequency_hz": [], "load": [], "cross": []}}, "0 frequency_hz"),
    ({"sensor_path": PATH | {"frequency_hz": [1000.0, 2000.0, 4000.0]}}, "adjoining third octaves"),
    ({"sensor_path": PATH | {"direct": 3}}, "unknown key"),
    ({"line_contact": {"traction": "film"}}, "needs a table"),
    ({"oil": {"iso_vg": 151}}, "state only iso_vg, one of 32, 46"),
    ({"oil": {"viscosity_40_mm2_s": 140}}, "or only both viscosities"),
    ({"oil": {"iso_vg": 150, "viscosity_40_mm2_s": 140}}, "or only both viscosities"),
    ({"oil": {"viscosity_40_mm2_s": 100, "viscosity_100_mm2_s": 100}}, "must fall"),
    ({"oil": {"viscosity_40_mm2_s": 7, "viscosity_100_mm2_s": 2.1, "temperature_c": 140}}, "lower the temperature"),
    ({"sensor_path": "rigg"}, "for a file write rigg.toml or ./rigg; did you mean 'rig'"),
]


@pytest.mark.timeout(60)
@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_wrong_scenes_say_what_is_wrong(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        paper_scene(**changes)


@pytest.mark.parametrize(
    ("changes", "offered"),
    [
        ({"solver": {"step_s": 2e-5}}, (1, 2, 3)),
        ({"solver": {"step_s": 1e-4}}, (1,)),
        ({"solver": {"step_s": 1e-4 / 7}, "output_rate": "20000 Hz"}, (1, 3, 4)),
        ({"solver": {"step_s": 1e-12}}, (100_000,)),
    ],
)
def test_a_refused_step_names_steps_that_are_taken(changes, offered):
    """The printed steps can be copied: a scene with one of them is accepted."""
    with pytest.raises(ConfigurationError) as refused:
        paper_scene(**changes, duration="0.1 s")
    printed = re.findall(r"1/(\d+) s \((\S+)\)", str(refused.value))
    rate = str(changes.get("output_rate", "20480 Hz"))
    assert [int(per_s) for per_s, _ in printed] == [n * int(rate.split()[0]) for n in offered]
    for _, seconds in printed:
        paper_scene(duration="0.1 s", output_rate=rate, solver={"step_s": float(seconds)})


def test_a_roller_defect_is_as_wide_as_the_drill_unless_told():
    assert paper_scene(defect={"kind": "roller"}).defect.extent_m == pytest.approx(0.002)
    assert paper_scene(defect={"kind": "roller", "extent": "5 mm"}).defect.extent_m == pytest.approx(0.005)
    assert paper_scene(defect={"kind": "outer"}).defect.extent_m is None


def test_several_defects_each_over_the_papers():
    inner = {"kind": "inner", "height": "-0.5 mm", "extent": "2 mm"}
    scene = paper_scene(defect={"kind": "outer"}, further_defects=[inner, {"kind": "outer"}])
    assert [d.kind.value for d in scene.defects] == ["outer", "inner", "outer"]
    assert scene.defects[1].height_m == pytest.approx(-5e-4)
    assert [d.points for d in with_points(scene, 1000).defects] == [4, 2, 4], "of the same length on denser points"


def test_the_mean_of_a_profile_is_over_the_recorded_time():
    """Speed from 10 rad/s to 14 rad/s at 2 s: mean 12 rad/s over 2 s, 11 rad/s over the first second."""
    loads = {"time": ["0 s", "2 s"], "radial": ["0 N", "100 kN"], "axial": ["10 kN", "0 N"]}
    assert paper_scene(load_profile=loads, duration="2 s").mean_radial_n == pytest.approx(50e3)
    table = {"time": ["0 s", "2 s"], "speed_rad_s": [10.0, 14.0]}
    assert paper_scene(speed_profile=table, duration="2 s").mean_shaft_rad_s == pytest.approx(12.0)
    assert paper_scene(speed_profile=table, duration="1 s").mean_shaft_rad_s == pytest.approx(11.0)


TABLE_4, NOTHING = (5e9, 5e5), (0.0, 0.0)  # N/m, Ns/m
HELD_BY = [  # scene, and what is described to hold its ring
    ("paper", {}, TABLE_4),
    ("paper", {"model": "line"}, TABLE_4),
    ("paper", {"load": {"path": "bearing"}}, NOTHING),
    ("paper", {"load": {"path": "bearing"}, "housing": {"damping": "2e3 Ns/m"}}, (0.0, 2e3)),
    ("rig", {}, (0.0, 3.1e4)),
    ("rig", {"model": "full", "housing": {"damping": "0 Ns/m"}}, NOTHING),
]


@pytest.mark.parametrize(("base", "changes", "described"), HELD_BY)
def test_nothing_that_is_not_described_holds_the_ring(base, changes, described):
    """A damper that is left over where a spring was taken away hides resonances: it was 0.40 of critical in `rig`."""
    scene = load_scene(base, changes)
    model, ring = parameters(scene), make_ring(scene, load_bearing("skf-22240")).kernel
    assert (model.housing_stiffness, model.housing_damping) == (ring.stiffness, ring.damping) == described


CLEARANCE_M = 92.5e-6  # the middle of the mounted clearance that the tables allow
# Of the gap at a roller; the scene's play has four digits, and the gap is not quite linear in the ring's displacement.
SAME_GAP = 1e-3
INPUTS = {one.keys[0]: one for one in rig_inputs()}


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
    [("rigg", "did you mean 'rig'"), ("papers", "did you mean 'paper'"), ("abc", "not known: .*; known: paper, rig")],
)
def test_unknown_names(name, message):
    with pytest.raises(ConfigurationError, match=message):
        load_scene(name)


def test_the_play_at_a_roller_follows_from_the_rings_clearance():
    """A ring displaced by half its clearance just touches the roller there; the play is the gap that closes."""
    geometry = load_bearing("skf-22240").geometry
    play = load_scene("rig").contact.radial_play_m
    across = geometry.inner_centre_radial_m, geometry.inner_centre_axial_m  # from the outer sphere's centre

    def gap_m(displaced_m: float) -> float:  # between two arcs, along the line through their centres
        return 2 * geometry.raceway_radius_m - math.hypot(across[0] + displaced_m, across[1])

    assert gap_m(0.0) - gap_m(CLEARANCE_M / 2) == pytest.approx(play, rel=SAME_GAP)
    assert gap_m(0.0) == pytest.approx(geometry.zero_play_diameter_m, rel=SAME_GAP)


@pytest.mark.parametrize("key", INPUTS)
def test_each_input_is_the_scenes(key):
    """The nominal value is the scene's value, and every value of the range makes a valid scene."""
    one = replace(INPUTS[key], high_from="")
    assert load_scene("rig", changes_at([replace(one, low=one.nominal)], [0.0])) == load_scene("rig")
    assert one.low <= one.nominal <= one.high > one.low
    assert one.points >= 2
    for share in one.shares:
        is_nominal = load_scene("rig", changes_at([one], [share])) == load_scene("rig")
        assert is_nominal == (one.value(share, one.high) == one.nominal)
    assert one.stands_for
    assert one.source


def test_every_value_of_the_rigs_own_has_a_range_or_a_reason():
    own, reasons = set(dict(walk_leaves(bundled_table("rig")))), bundled_table("rig_inputs")["no_range"]
    assert own == set(INPUTS) - {"load.direction"} | set(reasons), "besides the direction, which is the paper's"
    assert not set(INPUTS) & set(reasons)
    assert all(reasons.values())


# The mass of the rig's box: the reduced mass of box and shaft.
STEEL_KG_M3, STEEL_PA = 7850.0, 2.06e11
BORE_M, BEARING_KG = 0.200, 43.5  # SKF Rolling bearings, 2018, 22240 CCK/W33
BOX_KG = 75.0  # Table 4
RING_HZ = 1100.0  # along the load, of Table 4's box on the contacts' stiffness against a shaft that does not move
ROUNDED_KG, ROUNDED = 1.0, 0.02  # the scene's and the ranges' figures are rounded


def masses() -> tuple[float, float, float]:
    """Compute the masses of the outer ring alone, with the box of Table 4, and of the inner ring [kg]."""
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
    scene, ranges = load_scene("rig"), {one.keys[0]: one for one in rig_inputs()}
    mass, damping = ranges["housing.mass"], ranges["housing.damping"]
    assert scene.housing.mass_kg == pytest.approx(reduced - ring, abs=ROUNDED_KG)
    assert mass.low == pytest.approx(box * short / (box + short) - ring, abs=ROUNDED_KG)
    assert mass.high == BOX_KG
    assert damping.high == pytest.approx(0.07 * 2 * math.sqrt(stiffness * reduced), rel=ROUNDED)
    assert scene.housing.damping_ns_m == damping.high / 2


RA_TOLERANCE = 0.03  # classes are a factor of two apart
HALF = 0.4697  # ISO 16610-21
OPTIONS = ("", "--roughness N2", "--waviness-nm 28")


@pytest.mark.parametrize(
    ("name", "exponent", "ra_m", "cutoff_m", "finest_m"),
    [  # ISO 1302 and ISO 4288
        ("N2", 1.0, 0.05e-6, 0.25e-3, 2.5e-6),
        ("N4", 1.5, 0.2e-6, 0.8e-3, 2.5e-6),
        ("N7", 0.5, 1.6e-6, 0.8e-3, 2.5e-6),
    ],
)
def test_the_waves_have_the_ra_of_their_class(name, exponent, ra_m, cutoff_m, finest_m):
    """R_a = sqrt(2 / pi) R_q of normally distributed heights that the filters of ISO 16610-21 keep."""
    density_m = Surface(roughness_class=RoughnessClass(name), exponent=exponent).density_m()

    def kept(log_waves: float) -> float:
        waves_1_m = math.exp(log_waves)
        coarse, fine = (math.exp(-math.pi * (HALF * cut * waves_1_m) ** 2) for cut in (cutoff_m, finest_m))
        return density_m * waves_1_m ** (1 - 2 * exponent) * ((1 - coarse) * fine) ** 2

    square, _ = quad(kept, math.log(10.0), math.log(1e7), limit=200)
    assert math.sqrt(2 / math.pi * square) == pytest.approx(ra_m, rel=RA_TOLERANCE)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0])
def test_a_given_height_is_the_rms_of_the_waves(exponent):
    surface = Surface(outer_waviness_m=5e-8, exponent=exponent)
    amplitudes, orders = surface.amplitudes(1.0, 5e-8), surface.orders(1.0)
    assert np.sqrt(np.sum(amplitudes**2) / 2) == pytest.approx(5e-8)
    assert (orders[0], orders[-1]) == (20, 1000)
    assert amplitudes[-1] / amplitudes[0] == pytest.approx((1000 / 20) ** -exponent)


def test_heights_of_a_class_do_not_hang_on_the_size_of_the_body():
    """Waves of 1 to 10 mm are as high on a body three times as large, which has three times as many orders."""
    surface = Surface(roughness_class=RoughnessClass("N3"), shortest_m=1e-3, longest_m=10e-3)
    small, large = (np.sqrt(np.sum(surface.amplitudes(r, None) ** 2) / 2) for r in (0.3, 0.9))
    assert large == pytest.approx(small, rel=0.02)


def test_a_wave_that_fits_no_body_is_refused():
    surface = Surface(roller_waviness_m=1e-7, shortest_m=0.3, longest_m=0.4)
    with pytest.raises(ConfigurationError, match=r"no whole number of waves of 0\.3 to 0\.4 m fits around 0\.126 m"):
        surface.amplitudes(0.126, 1e-7)
    assert not surface.amplitudes(0.126, 0.0).size


def test_a_surface_is_stored_and_named_as_not_validated():
    waves, scene = "waves of races and rollers", paper_scene(surface={"roughness_class": "N3"})
    assert scene_dict(scene)["surface"]["roughness_class"] == "N3"
    assert waves in not_validated(scene)
    assert waves not in not_validated(paper_scene())
    assert "surface" not in scene_dict(paper_scene())


def test_options_give_a_class_or_one_height_to_all():
    parsed = (build_parser().parse_args(["simulate", "rig", *more.split()]) for more in OPTIONS)
    made = [scene_from_options(one).surface for one in parsed]
    assert (made[0], made[1]) == (None, Surface(roughness_class=RoughnessClass("N2")))
    assert made[2].given_m == pytest.approx((28e-9,) * 3)
