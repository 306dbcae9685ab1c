"""`analyse` on measured recordings: the right race line, with no option but the file; faults that are there alone."""

import dataclasses
import functools
import json
import os
from pathlib import Path

import pytest

from srbval import diagnose, load_recording
from srbval.bearing import Fault
from srbval.diagnosis.baseline import Baseline, baseline_of, compare_with_baseline
from srbval.diagnosis.fault_verdict import verdict_of
from srbval.reading.analyse import Analysis, analyse, bearing_of
from tests.diagnosis.test_fault_verdict import assert_no_contradiction

pytestmark = pytest.mark.recordings

# Orders read by an independent prototype from the same files (five-harmonic fit, squared envelope).
ORDER_TOLERANCE = 1e-3


@functools.cache
def analysed(folder: Path, name: str, channel: str | None = None) -> tuple[Fault | None, Analysis]:
    """State by the manifest, and the analysis, which does not see it."""
    if not (folder / name).is_file():
        pytest.skip(f"{name} is not among the recordings")
    recording = load_recording(folder / name, channel=channel)
    bearing = bearing_of(recording, None if recording.bearing else "uc-204")
    return recording.state, analyse(dataclasses.replace(recording, state=None), bearing=bearing)


@pytest.mark.parametrize(
    ("name", "line", "order"),
    [("torino/OR_877rpm_sample.mat", "BPFO", 8.186), ("torino/IR_877rpm_sample.mat", "BPFI", 10.817)],
)
def test_rig_orders_with_the_tachometer_s_speed(recordings_dir, name, line, order):
    _, result = analysed(recordings_dir, name)
    assert result.speed.source.value == "tachometer"
    assert result.line(line).detected
    assert result.line(line).found_hz / result.speed.value_hz == pytest.approx(order, rel=ORDER_TOLERANCE)
    assert result.closure["closed"] in (None, True)


def test_light_load_lets_the_cage_slip(recordings_dir):
    """The cage lags, most at the lightest load and least at the heaviest."""
    cage_pct = {}
    for number in (1, 3, 5, 7):
        _, result = analysed(recordings_dir, f"mfpt/InnerRaceFault_vload_{number}.mat")
        cage_pct[result.recording.radial_n] = -result.line("BPFI").deviation_pct
    assert max(cage_pct.values()) < 0
    assert cage_pct[min(cage_pct)] == min(cage_pct.values())
    assert cage_pct[max(cage_pct)] == max(cage_pct.values())


HEALTHY_OF = {"cwru": "97_Normal_0_48kDE.mat", "hit_sm": "Normal_1200.mat", "uestc": "N_1200_1.mat"}


def healthy_file(file: Path, dataset: str) -> Path | None:
    """The healthy record of the same machine, at the same speed as near as there is one."""
    if dataset == "torino":
        return file.with_name(f"H_{file.name.split('_')[1]}_sample.mat")
    return file.with_name(HEALTHY_OF[dataset]) if dataset in HEALTHY_OF else None


def test_no_tick_beside_a_fault_and_no_cross_on_a_healthy_bearing(recordings_dir):
    """Recordings alone and beside their healthy ones; labels by the manifest, which no analysis sees.

    Every ninth one, of all data sets, and of eight channels two; in the long form all.
    """
    findings, entries = {}, json.loads((recordings_dir / "manifest.json").read_text(encoding="utf-8"))
    every, channels = (1, range(1, 9)) if os.environ.get("SRBVAL_TESTS") == "all" else (9, (1, 7))
    taken = entries[every - 1 :: every]
    for entry in taken:
        path = recordings_dir / entry["file"]
        for channel in [f"ch{n}" for n in channels] if entry["dataset"] == "ims_test1" else [None]:
            state, analysis = analysed(recordings_dir, entry["file"], channel)
            alone = diagnose(analysis, all_channels=channel in (None, "ch1"))  # once each file: they are the same eight
            healthy = healthy_file(path, entry["dataset"])
            baselines: list[Baseline | None] = [None]
            if healthy is not None and healthy != path:
                baselines.append(baseline_of(analysis, load_recording(healthy)))
            for baseline in baselines:
                verdict = verdict_of(analysis, compare_with_baseline(analysis, baseline), alone)
                assert_no_contradiction(analysis, verdict)
                findings[entry["file"], channel, baseline is not None] = state, verdict
    assert [key for key, (state, v) in findings.items() if v.part and state in (None, Fault.HEALTHY)] == []
    assert [key for key, (state, v) in findings.items() if v.part not in (None, state)] == []
    for (file, channel, beside), (_, verdict) in findings.items():
        if not beside and (file, channel, True) in findings and verdict.part:
            assert findings[file, channel, True][1].part is verdict.part
    assert len(findings) > len(taken)
