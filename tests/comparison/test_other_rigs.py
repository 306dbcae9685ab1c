"""Recordings of other rigs: what counts as shown, and what the open sets show."""

from pathlib import Path

import pytest
from scipy.io import savemat

from srbval.bearing import Fault
from srbval.comparison.other_rigs import read_other_rigs
from srbval.reading.lines import RACE_LINES
from srbval.recordings import SpeedSource
from srbval.recordings.registry import add
from tests.recordings import files


def test_other_rigs_are_read_apart_from_the_rig(tmp_path: Path) -> None:
    noise = {"X105_DE_time": files.vibration(36000)[:, None], "X105RPM": 1797}
    savemat(tmp_path / "105_IR007_0_12kDE.mat", noise)
    files.excerpt(tmp_path / "OR_877rpm_made.mat", condition="OR", rpm_nominal=877)
    (record,) = read_other_rigs(add(tmp_path).recordings)
    assert record.line is not None
    assert (record.dataset, record.state, record.line.name, record.diagnosable) == ("cwru", Fault.INNER, "BPFI", True)
    assert (record.line.detected, record.shown) == (False, False)


@pytest.mark.slow
@pytest.mark.recordings
def test_open_recordings_show_their_faults(recordings_dir: Path) -> None:
    """Race faults by their published grade, in a band chosen on no record; healthy ones show none; near kinematics."""
    registered = [r for name in ("cwru", "mfpt", "hit_sm") for r in add(recordings_dir / name).recordings]
    records = [r for r in read_other_rigs(registered) if not r.refused]
    races = [r for r in records if r.line.name in RACE_LINES and r.state not in (None, Fault.HEALTHY)]
    assert len(races) >= 30
    plain = [r for r in races if (r.plain_grade or "").startswith("Y")]
    assert len(plain) >= 8
    assert all(r.shown for r in plain)
    graded = [r for r in races if r.diagnosable]  # by any method of the study: 197 by a kurtogram only
    assert sum(not r.shown for r in graded) <= 1
    held = [r for r in races if r.diagnosable is not False and not (r.plain_grade or "").startswith("N")]
    assert sum(r.shown for r in held) >= 0.95 * len(held)
    assert not [r.file for r in records if r.state is Fault.HEALTHY and (r.shown or r.call is None or r.call.indicated)]
    near = [
        abs(r.line.deviation_pct or 9) <= 0.5 for r in held if r.shown and r.speed.source is not SpeedSource.NOMINAL
    ]
    assert sum(near) >= 0.95 * len(near)


@pytest.mark.slow
@pytest.mark.recordings
def test_light_load_lets_the_cage_slip(recordings_dir: Path) -> None:
    """MFPT: inner and outer records agree on a cage that lags, least at the highest load."""
    records = [r for r in read_other_rigs(add(recordings_dir / "mfpt").recordings) if r.cage_pct is not None]
    loads = {
        race: sorted((r.radial_n, r.cage_pct) for r in records if r.line.name == race) for race in ("BPFO", "BPFI")
    }
    for race in loads.values():
        assert all(cage < 0 for _, cage in race)
        assert race[0][1] == min(cage for _, cage in race)
        assert race[-1][1] == max(cage for _, cage in race)
