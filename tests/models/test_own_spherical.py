"""Spherical roller bearings of other sizes run with defaults, from 60 to 300 mm bore, in the models with contacts."""

import math
from pathlib import Path

import pytest

import srbval
from srbval.bearing import load_bearing
from srbval.models.simulate import Step

# Made up, in the proportions of the series that they are named by: outer diameter, width, rollers, contact angle,
# pitch radius, roller diameter and width, in mm and degrees.
LIKE = {
    "22212": (110, 28, 18, 9.0, 43.2, 12.6, 11.5),
    "22216": (140, 33, 18, 8.5, 55.6, 16.0, 13.5),
    "22320": (215, 73, 16, 11.0, 79.0, 24.8, 30.0),
    "23136": (300, 96, 20, 10.0, 120.0, 31.0, 35.0),
    "24160": (500, 200, 24, 12.5, 200.0, 46.0, 76.0),
}
LINE_PCT = 0.1  # of the line that the run's own cage speed gives


def bearing_file(name: str, folder: Path) -> Path:
    """A bearing like that, as a file."""
    outer, width, rollers, tilt, pitch, diameter, length = LIKE[name]
    raceway, axial = pitch / math.cos(math.radians(tilt)) + diameter / 2, 2 * pitch * math.tan(math.radians(tilt))
    path = folder / f"{name}.toml"
    path.write_text(
        f'title = "like a {name}"\nsource = "made up"\n[geometry]\nraceway_radius = "{raceway!r} mm"\n'
        f'tilt = "{tilt} deg"\npitch_radius = "{pitch} mm"\nroller_width = "{length} mm"\n'
        f'roller_diameter = "{diameter} mm"\ninner_centre_radial = "{2 * pitch!r} mm"\n'
        f'inner_centre_axial = "{axial!r} mm"\nrollers_per_row = {rollers}\nouter_diameter = "{outer} mm"\n'
        f'width = "{width} mm"\n',
        encoding="utf-8",
    )
    return path


def check(path: Path, model: str, rpm: float, seconds: float) -> None:
    """Run with defaults, the step chosen as `srbval simulate` chooses it, and read the line."""
    scene = srbval.paper_scene(
        bearing=str(path), model=model, shaft_speed=f"{rpm} rpm", duration_s=seconds, defect={"kind": "outer"}
    )
    run = srbval.simulate(scene, step=Step.AUTO)
    assert run.status is srbval.RunStatus.OK, (path.stem, model, rpm, run.reason)
    line = srbval.analyse(srbval.recording_from_run(run), bearing=load_bearing(path)).line("BPFO")
    assert line.detected, (path.stem, model, rpm)
    assert line.found_hz == pytest.approx(run.bpfo_hz, rel=LINE_PCT / 100), (path.stem, model, rpm)


@pytest.mark.parametrize("name", LIKE)
def test_what_the_scene_leaves_open_goes_with_the_size(name: str, tmp_path: Path) -> None:
    own, usual = srbval.paper_scene(bearing=str(bearing_file(name, tmp_path))), srbval.paper_scene()
    size = LIKE[name][4] / 141.81
    assert own.load.radial_n == pytest.approx(usual.load.radial_n * size**2)
    assert own.housing.mass_kg == pytest.approx(usual.housing.mass_kg * size**3)
    assert own.contact.stiffness_n_m == pytest.approx(usual.contact.stiffness_n_m * size)
    assert own.defect.height_m == pytest.approx(usual.defect.height_m * size)
    assert own.solver.step_s <= usual.solver.step_s * max(size, 1.0) * (1 + 1e-9)
    assert own.load.path == "bearing"
    assert own.housing.damping_ns_m == pytest.approx(3.1e4 * size**2)  # the joints of `rig`
    stated = srbval.paper_scene(bearing=str(tmp_path / f"{name}.toml"), load={"radial": "5 kN"})
    assert stated.load.radial_n == 5e3


# The smallest and the largest, each with another model; all sizes at one speed or another in the long form.
CASES = [("full", "24160", 300.0), ("slices", "22212", 710.0)]
MORE = [("full", "22212", 1500.0), ("slices", "24160", 710.0)]
MORE += [("full", name, 710.0) for name in ("22216", "22320", "23136")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "name", "rpm"), [*CASES, *(pytest.param(*case, marks=pytest.mark.long_form) for case in MORE)]
)
def test_five_bearings_run_with_defaults(model: str, name: str, rpm: float, tmp_path: Path) -> None:
    check(bearing_file(name, tmp_path), model, rpm, max(0.8, 600 / rpm))
