"""`analyse` on measured recordings: the right race line, with no option but the file; faults that are there alone."""

import dataclasses
import functools
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval import Recording, diagnose, load_recording
from srbval.bearing import Fault
from srbval.diagnosis.baseline import Baseline, baseline_of, compare_with_baseline
from srbval.diagnosis.fault_posterior import LABELS
from srbval.diagnosis.fault_verdict import FaultVerdict, fault_verdict, verdict_of
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, ShortRecordError, analyse, bearing_of
from srbval.recordings.speed import nominal_speed
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


LARGEST_JUMP = 0.3  # of a probability, without a reason that the verdict prints
LEAST_CHANGE = 0.25  # of the log of one plus a comb's likelihood ratio, to be a reason


def changed_inputs(
    recording: Recording, band_hz: tuple[float, float]
) -> Iterator[tuple[str, Recording, dict[str, Any]]]:
    """The record with a set point's tolerance, another speed, a part of its duration, another window of its band."""
    speed, count, (low, high) = recording.known_speed, recording.samples, band_hz
    steady = dataclasses.replace(recording, speed_signal=None)
    for pct in (0.5, 2.0):
        set_point = nominal_speed(60 * speed.value_hz, pct)
        yield f"tolerance of {pct:g} %", dataclasses.replace(steady, speed=set_point), {}
    for factor in (0.998, 1.002):
        other = dataclasses.replace(speed, value_hz=factor * speed.value_hz)
        yield f"speed times {factor:g}", dataclasses.replace(steady, speed=other), {}
    for name, first, end in (("first half", 0, 0.5), ("second half", 0.5, 1), ("four fifths", 0, 0.8)):
        yield name, recording.part(int(first * count), int(end * count)), {}
    yield "upper part of the band", recording, {"band_hz": (low + (high - low) / 4, high)}


def printed_reason(before: FaultVerdict, after: FaultVerdict) -> str:
    """Evidence that changes most from one verdict to another, as both print it; empty if it is much the same."""
    combs = [one.diagnosis.scores.first for one in (before, after)]
    weight, earlier = ({n: float(np.logaddexp(0, comb.log_ratio)) for n, comb in c.items()} for c in reversed(combs))
    name = max(weight, key=lambda one: abs(weight[one] - earlier[one]))
    shown = [f"{x.excess:.1f} at {100 * x.depth:.0f} % {x.explained_by}".strip() for x in (c[name] for c in combs)]
    if abs(weight[name] - earlier[name]) > LEAST_CHANGE and shown[0] != shown[1]:
        return f"comb of {LABELS[name]}: {' became '.join(shown)}"
    lines = [{line.split()[0] for line in one.diagnosis.standing} for one in (before, after)]
    return f"strong lines: {' or '.join(sorted(lines[0] ^ lines[1]))}" if lines[0] != lines[1] else ""


def stability(folder: Path, file: str, channel: str | None = None) -> list[dict[str, Any]]:
    """Changes of the verdict on a record with its inputs: part, largest change of a probability, printed reason."""
    _, analysis = analysed(folder, file, channel)
    whole, rows = fault_verdict(analysis), []
    for changed, recording, options in changed_inputs(analysis.recording, analysis.processed.band_hz):
        try:
            verdict = fault_verdict(analyse(recording, bearing=analysis.bearing, **options))
        except ShortRecordError:  # a part of a short record
            continue
        shares, before = verdict.diagnosis.probabilities, whole.diagnosis.probabilities
        name = max(shares, key=lambda one: abs(shares[one] - before[one]))
        row = {"file": file, "channel": channel, "changed": changed, "before": whole.part, "part": verdict.part}
        row |= {"name": name, "jump": shares[name] - before[name]}
        flips = None not in (whole.part, verdict.part) and whole.part is not verdict.part
        rows.append(row | {"flips": flips, "reason": printed_reason(whole, verdict)})
    return rows


@pytest.mark.long_form
@pytest.mark.timeout(3600)
def test_verdicts_are_stable_under_their_inputs(recordings_dir):
    """Other inputs never name another part; where a probability jumps, the printed evidence differs. Prints a table."""
    rows = []
    for entry in json.loads((recordings_dir / "manifest.json").read_text(encoding="utf-8")):
        for channel in [f"ch{n}" for n in range(1, 9)] if entry["dataset"] == "ims_test1" else [None]:
            rows += stability(recordings_dir, entry["file"], channel)
    jumps = [row for row in rows if abs(row["jump"]) > LARGEST_JUMP]
    print(text_rows(jumps))
    assert [row for row in rows if row["flips"]] == []
    assert [row for row in jumps if not row["reason"]] == []
