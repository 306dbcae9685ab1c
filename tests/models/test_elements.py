"""Bearings of a user in every model that their tables allow; balls and rollers: contact, load zone, lines of runs."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import srbval
from srbval import ConfigurationError
from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.models.planar.contacts import POISSON, STRIBECK_FACTOR, YOUNG_N_M2, Ellipse, ellipse, make_element_slot
from srbval.models.planar.ring import make_ring
from srbval.models.simulate import Step
from srbval.scene import DefectShape

GUIDE = Path(srbval.__file__).parent / "docs" / "guide" / "your_bearing.md"
# Made up, in the proportions of the series that they are named by: outer diameter, width, rollers, contact angle,
# pitch radius, roller diameter and width, in mm and degrees.
LIKE = {
    "22212": (110, 28, 18, 9.0, 43.2, 12.6, 11.5),
    "22216": (140, 33, 18, 8.5, 55.6, 16.0, 13.5),
    "22320": (215, 73, 16, 11.0, 79.0, 24.8, 30.0),
    "23136": (300, 96, 20, 10.0, 120.0, 31.0, 35.0),
    "24160": (500, 200, 24, 12.5, 200.0, 46.0, 76.0),
}
LINE = 1e-3  # of the line that the run's own cage speed gives
CAGE = 0.02  # of the cage speed of pure rolling: slip of a well loaded bearing
KIND = {"BPFO": "outer", "BPFI": "inner", "2xBSF": "ball"}
# The largest; in the long form all sizes, at one speed or another, the smallest and the largest with both models.
SIZES = [("full", "24160", 300.0)]
MORE = [("full", "22212", 1500.0), ("slices", "24160", 710.0), ("slices", "22212", 710.0)]
MORE += [("full", name, 710.0) for name in ("22216", "22320", "23136")]
SHOWN = [(name, "BPFI", {"model": "kinematic"}) for name in ("orders", "elements", "geometry")]
SHOWN += [(name, "BPFI", {"model": "impulse"}) for name in ("elements", "geometry")]
FAST = {"shaft_speed": "1420 rpm", "duration_s": 0.5}
SHOWN += [("skf-6205", line, {"model": "planar"} | FAST) for line in KIND]
SHOWN += [("fag-nu2205", line, {"model": "planar"}) for line in ("BPFO", "BPFI")]  # 2xBSF is a multiple of the shaft's


def at_size(model: str, name: str, rpm: float) -> tuple[str, str, dict[str, object]]:
    bodies = {"cages": 2 if model == "slices" else 1}  # whose kernels others use as well
    speed = {"shaft_speed": f"{rpm} rpm", "duration_s": max(0.8, 600 / rpm)}
    return name, "BPFO", {"model": model, "bodies": bodies} | speed


def bearing_of(name: str, folder: Path) -> str:
    """A known bearing, or the file of one of the guide, by its table, or like that of a series."""
    path = folder / "mine.toml"
    if name in LIKE:
        outer, width, rollers, tilt, pitch, diameter, length = LIKE[name]
        raceway, axial = pitch / math.cos(math.radians(tilt)) + diameter / 2, 2 * pitch * math.tan(math.radians(tilt))
        text = (
            f'title = "like a {name}"\nsource = "made up"\n[geometry]\nraceway_radius = "{raceway!r} mm"\n'
            f'tilt = "{tilt} deg"\npitch_radius = "{pitch} mm"\nroller_width = "{length} mm"\n'
            f'roller_diameter = "{diameter} mm"\ninner_centre_radial = "{2 * pitch!r} mm"\n'
            f'inner_centre_axial = "{axial!r} mm"\nrollers_per_row = {rollers}\nouter_diameter = "{outer} mm"\n'
            f'width = "{width} mm"\n'
        )
    else:
        texts = re.findall(r"```toml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), flags=re.DOTALL)
        tables = {re.findall(r"^\[(\w+)\]", text, flags=re.MULTILINE)[0]: text for text in texts}
        if name not in tables:
            return name
        text = tables[name]
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "line", "changes"),
    [
        *SHOWN,
        *(at_size(*case) for case in SIZES),
        *(pytest.param(*at_size(*case), marks=pytest.mark.long_form) for case in MORE),
    ],
)
def test_a_run_with_defaults_shows_the_line_of_its_defect(name, line, changes, tmp_path):
    bearing = bearing_of(name, tmp_path)
    scene = srbval.paper_scene(bearing=bearing, defect={"kind": KIND[line]}, **{"duration_s": 1.0} | changes)
    run = srbval.simulate(scene, step=Step.AUTO)
    assert run.status is srbval.RunStatus.OK, run.reason
    found = srbval.analyse(srbval.recording_from_run(run), bearing=load_bearing(bearing)).line(line)
    own_hz = {"BPFO": run.bpfo_hz, "BPFI": run.bpfi_hz, "2xBSF": found.kinematic_hz}[line]
    assert found.detected
    assert found.found_hz == pytest.approx(own_hz, rel=LINE)
    assert changes["model"] != "planar" or run.roller_load_share == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("name", LIKE)
def test_what_the_scene_leaves_open_goes_with_the_size(name, tmp_path):
    bearing = bearing_of(name, tmp_path)
    own, usual = srbval.paper_scene(bearing=bearing), srbval.paper_scene()
    size = LIKE[name][4] / 141.81
    assert own.load.radial_n == pytest.approx(usual.load.radial_n * size**2)
    assert own.housing.mass_kg == pytest.approx(usual.housing.mass_kg * size**3)
    assert own.contact.stiffness_n_m == pytest.approx(usual.contact.stiffness_n_m * size)
    assert own.defect.height_m == pytest.approx(usual.defect.height_m * size)
    assert own.solver.step_s <= usual.solver.step_s * max(size, 1.0) * (1 + 1e-9)
    assert own.load.path == "bearing"
    assert own.housing.damping_ns_m == pytest.approx(3.1e4 * size**2)  # the joints of `rig`
    assert srbval.paper_scene(bearing=bearing, load={"radial": "5 kN"}).load.radial_n == 5e3


def test_a_users_bearing_in_the_full_model_and_in_its_run_file(tmp_path, srbval_json):
    file, scene, output = bearing_of("geometry", tmp_path), tmp_path / "scene.toml", tmp_path / "run.h5"
    scene.write_text(
        f'bearing = "{Path(file).as_posix()}"\nshaft_speed = "1480 rpm"\nduration = "0.2 s"\n[load]\nradial = "40 kN"\n'
        '[contact]\nroller_fit = "play"\n',
        encoding="utf-8",
    )
    document, bearing = srbval_json("simulate", scene, "-o", output), load_bearing(file)
    assert document["cage_ratio"] == pytest.approx(bearing.orders.ftf, rel=CAGE)
    assert any("only the skf-22240 was compared with measurements" in what for what in document["not_validated"])
    Path(file).unlink()
    read = srbval.load_recording(output)
    assert any("not validated" in note and "only the skf-22240" in note for note in read.notes)
    for value in ("title", "source", "rolling_elements", "orders"):
        assert getattr(read.own_bearing, value) == getattr(bearing, value)


INNER_6206 = (2 / 9.525e-3 / (1 - 9.525 / 46), (2 - 9.525 / 4.89) / 9.525e-3)  # groove 4.89 mm, pitch 46 mm
INTEGRALS = 1e-3  # of displacements by quadrature
STRIBECK = 0.01  # of the largest load: the rounded constants 4.37 and 4.08


def displacement_m(e: Ellipse, force_n: float, x: float) -> float:
    """Approach of two half-spaces at `x` across the race under Hertz's pressure, by Boussinesq's integral.

    In polar coordinates about the point the pressure along a ray is p0 sqrt(c - 2 b r - a r^2): no 1 / r is left.
    """
    a, b = e.across_m * force_n ** (1 / 3), e.along_m * force_n ** (1 / 3)
    peak = 1.5 * force_n / (math.pi * a * b)

    def along_ray(angle: float) -> float:
        c, s = math.cos(angle), math.sin(angle)
        qa, qb, qc = (c / a) ** 2 + (s / b) ** 2, x * c / a**2, 1 - (x / a) ** 2
        end = (-qb + math.sqrt(qb**2 + qa * qc)) / qa
        return quad(lambda r: math.sqrt(max(qc - 2 * qb * r - qa * r**2, 0.0)), 0.0, end)[0]

    return 2 * (1 - POISSON**2) / (math.pi * YOUNG_N_M2) * peak * quad(along_ray, 0.0, 2 * math.pi)[0]


@pytest.mark.parametrize("curvatures", [INNER_6206, (252.0, 20.0), (200.0, 60.0)])
def test_under_hertzs_pressure_half_spaces_take_the_bodies_shape(curvatures):
    """The integral equation itself: the approach in the middle, less the gap's half curvature times x squared."""
    e, force = ellipse(*curvatures), 300.0
    approach = e.approach_m * force ** (2 / 3)
    assert displacement_m(e, force, 0.0) == pytest.approx(approach, rel=INTEGRALS)
    for share in (0.4, 0.8):
        x = share * e.across_m * force ** (1 / 3)
        assert displacement_m(e, force, x) == pytest.approx(approach - curvatures[1] * x**2 / 2, rel=INTEGRALS)


@pytest.mark.parametrize("name", ["skf-6205", "fag-nu2205", "fag-qj212"])
def test_strips_add_up_to_the_contact_law_and_balance_on_both_races(name):
    bearing = load_bearing(name)
    slot = make_element_slot(srbval.paper_scene(bearing=name), bearing.elements)
    power = 1.5 if bearing.elements.shape == "ball" else 10 / 9
    low, high = slot.press(np.array([5e-6, 2e-5]))[0]
    assert math.log(high / low) / math.log(4) == pytest.approx(power, rel=1e-6)
    assert slot.press(np.array([-1e-6]))[0, 0] == 0.0
    if power > 1.2:  # the stiffness of both contacts in series, by the ellipses' own
        each = [ellipse(r.along_1_m, (2 - 1 / 0.52) / bearing.elements.element_diameter_m) for (r,) in slot.races]
        whole = sum(e.approach_m for e in each) ** -1.5
        assert high == pytest.approx(whole * 2e-5**1.5 * math.cos(slot.races[0][0].normal_rad) ** 2.5, rel=1e-6)
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
    share = float(ring.kernel.plain.at(np.array([deepest]))[0, 0]) * 90 / scene.load.radial_n
    assert share == pytest.approx(STRIBECK_FACTOR[many.elements.shape], rel=STRIBECK)


def test_a_pit_takes_load_and_a_bump_adds_it():
    bearing = load_bearing("skf-6205")
    scene = srbval.paper_scene(bearing="skf-6205", defect={"kind": "outer"})
    slot = make_element_slot(scene, bearing.elements)
    approach, middle = np.array([[2.5e-5]]), np.array([[0.0, 1e-4, 5e-4]])
    sound = slot.press(approach)[0, 0, 0]

    def pressed(race: int, **changes: float) -> FloatArray:
        raised = slot.place_on_race(replace(scene.defect, **changes), race, 1e-4)
        return slot.press(approach, raised._replace(middle_m=middle))[0, 0]

    lost = [sound - pressed(race, extent_m=extent) for extent in (2e-4, 4e-4, 8e-4) for race in (0, 1)]
    for some in lost:
        assert 0 < some[0] < sound
        assert some[0] >= some[1] >= some[2] >= 0
    assert lost[0][0] < lost[2][0] < lost[4][0]
    assert pressed(0, height_m=5e-6)[0] > sound


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


def test_a_defect_without_extent_is_refused_with_a_legal_one():
    scene = srbval.paper_scene(bearing="skf-6205", defect={"kind": "outer"})
    with pytest.raises(ConfigurationError, match=r"0\.5 mm"):
        srbval.simulate(replace(scene, defect=replace(scene.defect, shape=DefectShape.FLAT, extent_m=None)))
