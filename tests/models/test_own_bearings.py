"""Bearings of a user, of any size: every model that their tables allow, and what is then not validated is said."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import srbval
from srbval.bearing import load_bearing
from srbval.models.simulate import Step

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
ROUNDING = 1e-9
KIND = {"BPFO": "outer", "BPFI": "inner", "2xBSF": "ball"}
# The smallest and the largest, each with another model; all sizes at one speed or another in the long form.
SIZES = [("full", "24160", 300.0), ("slices", "22212", 710.0)]
MORE = [("full", "22212", 1500.0), ("slices", "24160", 710.0)]
MORE += [("full", name, 710.0) for name in ("22216", "22320", "23136")]
SHOWN = [
    (name, "BPFI", {"model": model})
    for name in ("orders", "elements", "geometry")
    for model in ("kinematic", "impulse")
]
SHOWN += [("skf-6205", line, {"model": "planar"}) for line in KIND]
SHOWN += [("fag-nu2205", line, {"model": "planar"}) for line in ("BPFO", "BPFI")]  # 2xBSF is a multiple of the shaft's


def at_size(model: str, name: str, rpm: float) -> tuple[str, str, dict[str, object]]:
    return name, "BPFO", {"model": model, "shaft_speed": f"{rpm} rpm", "duration_s": max(0.8, 600 / rpm)}


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


def test_the_full_model_runs_where_there_is_one(tmp_path, srbval_json):
    file, scene, output = bearing_of("geometry", tmp_path), tmp_path / "scene.toml", tmp_path / "run.h5"
    scene.write_text(
        f'bearing = "{Path(file).as_posix()}"\nshaft_speed = "1480 rpm"\nduration = "0.2 s"\n[load]\nradial = "40 kN"\n'
        '[contact]\nroller_fit = "play"\n',
        encoding="utf-8",
    )
    document = srbval_json("simulate", scene, "-o", output)
    assert document["cage_ratio"] == pytest.approx(load_bearing(file).orders.ftf, rel=CAGE)
    assert any("held against the skf-22240 alone" in what for what in document["not_validated"])
    notes = srbval.load_recording(output).notes
    assert any("not validated" in note and "skf-22240 alone" in note for note in notes)


def test_pulses_without_dimensions_follow_the_load():
    given = {"model": "impulse", "bearing": "fag-22205", "duration": "0.5 s", "defect": {"kind": "outer"}}
    whole, half = (srbval.paper_scene(**given, load={"radial": load}) for load in ("124.8 kN", "62.4 kN"))
    whole_rms, half_rms = (np.sqrt(np.mean(srbval.simulate(s).acceleration_m_s2 ** 2)) for s in (whole, half))
    assert half_rms == pytest.approx(whole_rms / 2, rel=ROUNDING)
