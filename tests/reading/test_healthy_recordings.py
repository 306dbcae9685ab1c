"""Nothing is reported on healthy bearings: every fault line is read, in the record's own band, without labels."""

import dataclasses
import math

import pytest

from srbval.bearing import DEFECTS, load_bearing
from srbval.diagnosis.fault_verdict import Finding, fault_verdict
from srbval.models.simulate import simulate
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import Origin, recording_from_run
from srbval.scene import paper_scene

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
def test_healthy_model_shows_no_fault(rpm: float, fit: str) -> None:
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
