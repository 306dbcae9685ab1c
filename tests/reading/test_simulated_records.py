"""Simulated records: nothing is reported on healthy ones; a roller fault's line and spacing are read together."""

import dataclasses
import math

import pytest

from srbval import Analysis, Origin, analyse, paper_scene, recording_from_run, simulate
from srbval.bearing import DEFECTS, Fault, load_bearing
from srbval.comparison.counterpart import SimulationCase, analyse_run
from srbval.diagnosis.fault_verdict import Finding, fault_verdict
from srbval.reading.pipeline import SIMULATED_BAND_HZ

RIG = load_bearing("skf-22240")
TURNS = 30.0


def assert_nothing_reported(result: Analysis, baseline: Analysis | None = None) -> None:
    """Race and roller lines were all within reach, and no fault is named."""
    assert all(result.line_of(fault).found_hz is not None for fault in DEFECTS)
    verdict = fault_verdict(result, baseline)
    assert verdict.finding in (Finding.UNDECIDED, Finding.NOTHING_FOUND)
    assert verdict.part is None


@pytest.mark.parametrize(
    ("rpm", "fit"), [(710.0, "play"), pytest.param(997.0, "play", marks=pytest.mark.long_form), (858.0, "printed")]
)
def test_healthy_model_shows_no_fault(rpm, fit):
    """Judged as if it had been measured and not labelled, alone and against another run of the same bearing."""
    judged, before = (model(rpm, fit, settle) for settle in ("0.05 s", "0.17 s"))
    assert_nothing_reported(judged)
    assert_nothing_reported(judged, before)


def model(rpm: float, fit: str, settle: str) -> Analysis:
    scene = paper_scene(
        duration_s=TURNS * 60 / rpm,
        shaft_speed_rad_s=rpm * math.pi / 30,
        defect={"kind": "none"},
        settle=settle,
        contact={"roller_fit": fit},
    )
    recording = recording_from_run(simulate(scene))
    as_measured = dataclasses.replace(recording, origin=Origin.MEASURED, state=None, band_hz=SIMULATED_BAND_HZ)
    return analyse(as_measured, bearing=RIG)


BEARING = load_bearing("skf-22240")


def test_the_model_s_roller_and_cage_are_read_from_its_vibration():
    """Both are known from the run: the damaged roller's own turning, seen from its slot, and the cage's speed."""
    scene = paper_scene(
        duration_s=4.0,
        contact={"roller_fit": "printed"},
        defect={"kind": "roller", "height": "-0.1 mm"},
        detail_rate_hz=1024.0,
    )
    run = simulate(scene)
    side = analyse_run(SimulationCase(id="r", purpose="test", state=Fault.ROLLER, scene=scene), run, BEARING)
    line, shaft_hz = side.analysis.line("2xBSF"), scene.shaft_hz
    assert line.detected
    assert abs(line.found_hz - side.line_order * shaft_hz) <= line.ci95_hz
    assert line.ci95_hz < 1e-3 * line.found_hz
    assert abs(line.sideband_hz - run.cage_ratio * shaft_hz) <= line.sideband_ci95_hz
    assert line.sideband_ci95_hz < 0.01 * line.sideband_hz
    assert all(side.analysis.line(name).detected for name in ("2xBSF-FTF", "2xBSF+FTF"))
    # Three contact circles of different radii: the roller turns faster than its middle circle alone would have it.
    assert 1.01 < side.line_order / (2 * BEARING.orders.bsf) < 1.03
    assert math.isclose(run.cage_ratio, BEARING.orders.ftf, rel_tol=0.005)
