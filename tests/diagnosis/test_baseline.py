"""The healthy record beside a record: what differs is said, and what that costs is measured."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.diagnosis.baseline import baseline_of, load_healthy
from srbval.diagnosis.baseline_comparison import CALLING_RATIO, OTHER_CONDITIONS, Baseline, compare_with_baseline
from srbval.errors import ConfigurationError
from srbval.reading.analyse import analyse, bearing_of
from srbval.recordings import RecordingSettings, load_recording
from srbval.recordings.speed import nominal_speed
from tests.reading.test_shaft_speed import BEARING, record

BANDS_HZ = ((500, 1000), (1000, 2000), (1400, 2800), (2000, 4000), (4000, 8000))


def healthy(**changes):
    plain = record(shaft_hz=25.0, fault=False, seed=9)
    return dataclasses.replace(plain, state=Fault.HEALTHY, name="healthy one", **changes)


def test_what_differs_is_named() -> None:
    ours = analyse(dataclasses.replace(record(shaft_hz=25.0), radial_n=1000.0), bearing=BEARING)
    other = healthy(radial_n=500.0, unit="unknown", speed=nominal_speed(1200.0, 0.5))
    found = baseline_of(ours, other)
    assert found.conditions == ("1200 rpm instead of 1500 rpm", "radial load 0.5 kN instead of 1 kN")
    assert found.remarks == ("not both in m/s2: lines are compared as shares of the mean, not as levels",)


def test_a_weak_rise_is_called_under_the_same_conditions_alone() -> None:
    """A ratio between what is asked for at the same speed and at another is called only at the same."""
    ours, theirs = analyse(record(shaft_hz=25.0), bearing=BEARING), analyse(healthy(), bearing=BEARING)
    line, ratio = ours.line("BPFI"), 1.5 * CALLING_RATIO
    risen = dataclasses.replace(theirs.line("BPFI"), depth=line.depth / ratio, snr=line.snr, explained_by=None)
    lines = tuple(risen if (x.name, x.harmonic) == ("BPFI", 1) else x for x in theirs.lines)
    theirs = dataclasses.replace(theirs, lines=lines, recording=dataclasses.replace(theirs.recording, unit="unknown"))
    assert compare_with_baseline(ours, theirs).called is Fault.INNER
    elsewhere = compare_with_baseline(ours, Baseline(analysis=theirs, conditions=("another speed",)))
    assert elsewhere.called is None
    assert "another speed" in elsewhere.sentence


@pytest.mark.recordings
def test_a_record_declared_faulty_is_no_baseline(recordings_dir: Path) -> None:
    with pytest.raises(ConfigurationError, match="declared inner race"):
        load_healthy(str(recordings_dir / "mfpt" / "InnerRaceFault_vload_7.mat"), RecordingSettings())


@pytest.mark.recordings
def test_what_other_conditions_cost_is_what_the_rig_shows(recordings_dir: Path) -> None:
    """Shares of the race and roller lines in five bands, at 353 and 877 rpm: scatter and largest change."""
    slow, fast = (load_recording(recordings_dir / "torino" / f"H_{rpm}rpm_sample.mat") for rpm in (353, 877))
    bearing = bearing_of(slow)
    changes = []
    for band_hz in BANDS_HZ:
        one, other = (analyse(x, bearing=bearing, band_hz=band_hz) for x in (slow, fast))
        depths = ((one.line(name).depth, other.line(name).depth) for name in ("BPFO", "BPFI", "2xBSF"))
        changes += [abs(math.log(b / a)) for a, b in depths if a and b]
    assert len(changes) == 15
    assert math.exp(max(changes)) <= OTHER_CONDITIONS
    assert math.exp(1.96 * math.sqrt(np.mean(np.square(changes)))) == pytest.approx(OTHER_CONDITIONS, rel=0.1)
