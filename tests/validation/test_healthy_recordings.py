"""No healthy record is reported as faulty, even when its label is not told."""

import dataclasses

import pytest

from srbval.bearing import load_bearing
from srbval.models.simulate import simulate
from srbval.recordings import load_recording
from srbval.recordings.from_run import recording_from_run
from srbval.scene import paper_scene
from srbval.validation.analyse import analyse
from srbval.validation.fault_call import call_fault

ALONE = ("cwru/97_Normal_0_48kDE.mat", "hit_sm/Self-built/Normal_1200.mat", "hit_sm/SpectraQuest/Normal_1200.mat")


def unlabelled(recording):
    return dataclasses.replace(recording, state=None)


@pytest.mark.recordings
@pytest.mark.parametrize("name", ALONE)
def test_healthy_record_indicates_no_fault_without_its_label(recordings_dir, name):
    recording = load_recording(recordings_dir / name)
    call = call_fault(analyse(unlabelled(recording), bearing=load_bearing(recording.bearing)))
    assert call.called is None
    assert call.indicated is None


@pytest.mark.recordings
def test_rig_s_healthy_record_is_no_fault_by_its_own_baseline_rule(recordings_dir):
    bearing = load_bearing("skf-22240")
    healthy = load_recording(recordings_dir / "torino" / "H_877rpm_sample.mat")
    baseline = analyse(healthy, bearing=bearing)
    assert call_fault(analyse(unlabelled(healthy), bearing=bearing), baseline).called is None
    fault = load_recording(recordings_dir / "torino" / "OR_877rpm_sample.mat")
    assert call_fault(analyse(unlabelled(fault), bearing=bearing), baseline).called is not None


def test_healthy_model_shows_no_line_as_deep_as_a_fault_s():
    run = simulate(paper_scene(duration_s=2.0, defect={"kind": "none"}))
    result = analyse(recording_from_run(run), bearing=load_bearing("skf-22240"))
    assert call_fault(result).called is None
    races = [x for x in result.lines if x.harmonic == 1 and x.name in ("BPFO", "BPFI", "2xBSF")]
    assert races
    assert all(not x.detected or x.depth < 0.5 for x in races)
