"""Nothing is reported on healthy bearings: every fault line is looked for, in the record's own band, labels removed."""

import dataclasses
import math
from pathlib import Path

import pytest

from srbval.bearing import DEFECTS, load_bearing
from srbval.diagnosis.fault_verdict import Finding, fault_verdict
from srbval.models.simulate import simulate
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import Origin, Recording, load_recording, recording_from_run
from srbval.recordings.speed import tachometer_speed
from srbval.scene import paper_scene

RIG = load_bearing("skf-22240")
TURNS = 30.0


def unlabelled(recording: Recording) -> Recording:
    return dataclasses.replace(recording, state=None)


def assert_nothing_reported(result: Analysis, baseline: Analysis | None = None) -> None:
    """Race and roller lines were all within reach, and no fault is named."""
    assert all(result.line_of(fault).found_hz is not None for fault in DEFECTS)
    verdict = fault_verdict(result, baseline)
    assert verdict.finding in (Finding.UNDECIDED, Finding.NOTHING_FOUND)
    assert verdict.part is None


def part(recording: Recording, start_s: float, end_s: float) -> Recording:
    """A piece of a record, with its own piece of the speed signal."""
    first, last = (round(t * recording.fs_hz) for t in (start_s, end_s))
    channels = {name: samples[first:last] for name, samples in recording.channels.items()}
    whole = recording.speed_signal
    values = whole.values_hz[round(start_s * whole.rate_hz) : round(end_s * whole.rate_hz)]
    signal = dataclasses.replace(whole, values_hz=values)
    return dataclasses.replace(recording, channels=channels, speed=tachometer_speed(values), speed_signal=signal)


@pytest.mark.recordings
@pytest.mark.parametrize(("rpm", "pieces"), [(877, ((0.0, 1.0), (1.0, 2.0))), (353, ((0.0, 1.55), (0.45, 2.0)))])
def test_rig_s_healthy_record_is_no_fault_by_its_own_baseline_rule(
    recordings_dir: Path, rpm: int, pieces: tuple[tuple[float, float], ...]
) -> None:
    """One piece of the healthy record is the baseline of the other; at 353 rpm eight turns need more than a half."""
    healthy = load_recording(recordings_dir / "torino" / f"H_{rpm}rpm_sample.mat")
    first, second = (part(healthy, *piece) for piece in pieces)
    for judged, before in ((first, second), (second, first)):
        assert_nothing_reported(analyse(unlabelled(judged), bearing=RIG), analyse(before, bearing=RIG))


@pytest.mark.parametrize(("rpm", "fit"), [(710.0, "play"), (997.0, "play"), (858.0, "printed")])
def test_healthy_model_shows_no_fault(rpm: float, fit: str) -> None:
    """Judged as if it had been measured and not labelled, alone and against another run of the same bearing."""
    judged, before = (model(rpm, fit, settle) for settle in ("0.05 s", "0.17 s"))
    assert_nothing_reported(judged)
    assert_nothing_reported(judged, before)


def model(rpm: float, fit: str, settle: str) -> Analysis:
    scene = paper_scene(
        duration_s=TURNS * 60 / rpm, shaft_speed_rad_s=rpm * math.pi / 30, defect={"kind": "none"}, settle=settle,
        contact={"roller_fit": fit},
    )  # fmt: skip
    recording = recording_from_run(simulate(scene))
    as_measured = dataclasses.replace(recording, origin=Origin.MEASURED, state=None, band_hz=SIMULATED_BAND_HZ)
    return analyse(as_measured, bearing=RIG)
