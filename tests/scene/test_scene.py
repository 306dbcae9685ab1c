import re

import pytest

from srbval import ConfigurationError, paper_scene

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


PATH = {
    "frequency_hz": [1000.0, 1258.9254, 1584.8932],
    "load": [2.0, 0.5, 1.0],
    "cross": [6.0, 1.5, 3.0],
    "source": "test",
}
REFUSED = [
    ({"shaft_sped": "710 rpm"}, "did you mean 'shaft_speed'"),
    ({"contact": {"stiffness": "-1 N/m"}}, "contact stiffness_n_m = -1 must be positive"),
    ({"contact": {"static_friction": 0.1}}, "must not be below"),
    ({"defect": {"circle": 4}}, "between 1 and 3"),
    ({"defect": {"height": "5 mm"}}, "between -0.001 and 0.001"),
    ({"duration": "1 us"}, "shorter than one output interval"),
    ({"speed_profile": {"time": ["0 s", "5 s"], "speed": ["1 rpm", "2 rpm"]}}, "covers 0 to 5 s; the run records 0"),
    ({"speed_profile": {"time_s": [0.0, float("nan")], "speed": ["1 rpm", "2 rpm"]}}, "not finite"),
    ({"speed_profile": {"time": ["0 s", "20 s"], "speed": ["1 rpm"]}}, "one value for each"),
    (
        {"speed_profile": {"time": ["0 s", "20 s"], "speed": ["1 rpm", "-2 rpm"]}},
        "speed_rad_s = -0.2.* must not be negative",
    ),
    ({"defect": {"kind": "outer", "refinement": 4}}, "needs an extent"),
    ({"defect": {"kind": "outer", "extent": "80 mm"}}, "at most 0.05"),
    ({"detail_rate": "300 Hz"}, "must divide"),
    ({"duration_s": 1e12}, "1e\\+12"),
    ({"output_rate_hz": 1e15}, "1e\\+15.*1e\\+06"),
    ({"solver": {"step_s": 1e-30}}, "steps per output"),
    ({"contact": {"points_per_circle": 10**9}}, "1000000000.*100000"),
    ({"further_defects": [{"kind": "outer"}] * 10**6}, "100000[01].*20"),
    ({"contact": {"stiffness_n_m": 1e300}}, "1e\\+300"),
    ({"seed": -1}, "seed = -1"),
    ({"load": {"direction_rad": 1e300}}, "1e\\+300"),
    ({"surface": {}}, "no height: state roughness_class"),
    ({"surface": {"outer_waviness": "-1 um"}}, "between 0 and 0.0001"),
    ({"surface": {"roughness_class": "N13"}}, "'N13' is not known"),
    ({"surface": {"roughness_class": "N3", "exponent": 3}}, "exponent = 3 must be between 0 and 2"),
    ({"surface": {"roughness_class": "N3", "shortest": "2 mm", "longest": "1 mm"}}, "must be below longest"),
    ({"surface": {"roughness_class": "N3", "shortest": "1 um"}}, "shortest_m = 1e-06 must be 0.0001 or more"),
    ({"surface": {"race_waviness": "1 um"}}, "unknown key 'race_waviness'"),
    ({"sensor_path": PATH | {"load": [0.0, 1.0, 1.0]}}, "load"),
    ({"sensor_path": PATH | {"cross": [1.0, 1.0]}}, "3 load, 2 cross"),
    ({"sensor_path": PATH | {"u_db": [1.0]}}, "1 u_db"),
    ({"sensor_path": PATH | {"u_db": [-1.0, 1.0, 1.0]}}, "u_db"),
    ({"sensor_path": PATH | {"frequency_hz": [], "load": [], "cross": []}}, "0 frequency_hz"),
    ({"sensor_path": PATH | {"frequency_hz": [1000.0, 2000.0, 4000.0]}}, "adjoining third octaves"),
    ({"sensor_path": PATH | {"direct": 3}}, "unknown key"),
    ({"line_contact": {"traction": "film"}}, "needs a table"),
    ({"oil": {"iso_vg": 151}}, "known are 32, 46"),
    ({"oil": {"viscosity_40_mm2_s": 140}}, "state iso_vg"),
    ({"oil": {"viscosity_40_mm2_s": 100, "viscosity_100_mm2_s": 100}}, "must fall"),
    ({"oil": {"viscosity_40_mm2_s": 7, "viscosity_100_mm2_s": 2.1, "temperature_c": 140}}, "lower the temperature"),
    ({"sensor_path": "rigg"}, r"Known: none, rig"),
]


@pytest.mark.timeout(20)
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
    """As they are printed: who copies one is not refused again."""
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
    scene = paper_scene(
        defect={"kind": "outer"}, further_defects=[{"kind": "inner", "height": "-0.5 mm", "extent": "2 mm"}]
    )
    assert [d.kind.value for d in scene.defects] == ["outer", "inner"]
    assert scene.defects[1].height_m == pytest.approx(-5e-4)


def test_the_mean_of_a_profile_is_over_the_recorded_time():
    """10 rad/s at the beginning, 14 at 2 s: 12 over 2 s, 11 over the first."""
    loads = {"time": ["0 s", "2 s"], "radial": ["0 N", "100 kN"], "axial": ["10 kN", "0 N"]}
    assert paper_scene(load_profile=loads, duration="2 s").mean_radial_n == pytest.approx(50e3)
    table = {"time": ["0 s", "2 s"], "speed_rad_s": [10.0, 14.0]}
    assert paper_scene(speed_profile=table, duration="2 s").mean_shaft_rad_s == pytest.approx(12.0)
    assert paper_scene(speed_profile=table, duration="1 s").mean_shaft_rad_s == pytest.approx(11.0)
