"""Fault calls: against the healthy record of the same point, and never on a line alone."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

import pytest

from srbval.bearing import Fault, load_bearing
from srbval.diagnosis.baseline_comparison import Basis, compare_with_baseline
from srbval.reading.analyse import analyse
from srbval.recordings import load_recording
from srbval.recordings.registry import add, healthy_baseline
from tests.reading.test_shaft_speed import BEARING, record
from tests.recordings import files


def healthy():
    return dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=9), state=Fault.HEALTHY, name="healthy one")


@functools.cache
def faulted_analysis():
    return analyse(record(shaft_hz=25.0), bearing=BEARING)


@functools.cache
def healthy_analysis():
    return analyse(healthy(), bearing=BEARING)


def test_line_alone_cannot_tell() -> None:
    call = compare_with_baseline(faulted_analysis())
    assert (call.basis, call.indicated, call.called) == (Basis.LINE_ALONE, Fault.INNER, None)
    assert "a line alone cannot tell" in call.sentence


def test_fault_stands_above_the_healthy_record() -> None:
    call = compare_with_baseline(faulted_analysis(), healthy_analysis())
    assert (call.basis, call.called, call.line) == (Basis.BASELINE, Fault.INNER, "BPFI")
    assert call.ratio is not None
    assert call.ratio_ci95 is not None
    assert 2 < call.ratio_ci95[0] < call.ratio < call.ratio_ci95[1]


def test_scale_free_where_the_unit_is_unknown() -> None:
    quiet = healthy()
    loud = dataclasses.replace(quiet, unit="unknown", channels={"x": 1000 * quiet.channels["x"]})
    faulted = dataclasses.replace(record(shaft_hz=25.0), unit="unknown")
    assert (
        compare_with_baseline(analyse(faulted, bearing=BEARING), analyse(loud, bearing=BEARING)).called is Fault.INNER
    )


@pytest.mark.parametrize(("second", "indicated"), [(0.12, None), (0.3, Fault.OUTER), (None, Fault.OUTER)])
def test_a_smooth_outer_race_line_is_rollers_passing_under_load(second: float | None, indicated: Fault | None) -> None:
    """Strikes have harmonics; varying compliance of a healthy bearing next to none."""
    analysis = faulted_analysis()
    depths = {("BPFO", 1): 0.6, ("BPFO", 2): second}
    lines = tuple(
        dataclasses.replace(x, depth=depths.get((x.name, x.harmonic)), detected=(x.name, x.harmonic) == ("BPFO", 1))
        for x in analysis.lines
    )
    assert compare_with_baseline(dataclasses.replace(analysis, lines=lines)).indicated is indicated


def test_baseline_is_the_healthy_record_of_the_same_speed_and_load(tmp_path: Path) -> None:
    for state, rpm in (("H", 353), ("H", 877), ("OR", 877), ("OR", 353)):
        files.excerpt(
            tmp_path / f"{state}_{rpm}rpm_a.mat",
            condition=state,
            rpm_nominal=rpm,
            rpm=0.97 * rpm + 0 * files.vibration(128),
        )
    add(tmp_path)
    found = healthy_baseline(load_recording(tmp_path / "OR_877rpm_a.mat"))
    assert found is not None
    assert Path(found.file).name == "H_877rpm_a.mat"
    assert healthy_baseline(load_recording(tmp_path / "H_877rpm_a.mat")) is None
    (tmp_path / "H_877rpm_a.mat").unlink()
    assert healthy_baseline(load_recording(tmp_path / "OR_877rpm_a.mat")) is None


@pytest.mark.recordings
@pytest.mark.parametrize(("name", "called"), [("OR", Fault.OUTER), ("IR", Fault.INNER), ("H", None)])
def test_rig_excerpts(recordings_dir: Path, name: str, called: Fault | None) -> None:
    bearing = load_bearing("skf-22240")
    baseline = analyse(load_recording(recordings_dir / "torino" / "H_877rpm_sample.mat"), bearing=bearing)
    result = analyse(load_recording(recordings_dir / "torino" / f"{name}_877rpm_sample.mat"), bearing=bearing)
    assert compare_with_baseline(result, None if name == "H" else baseline).called is called


def test_healthy_label_on_a_deep_line_is_doubted() -> None:
    mislabelled = dataclasses.replace(record(shaft_hz=25.0), state=Fault.HEALTHY)
    call = compare_with_baseline(analyse(mislabelled, bearing=BEARING))
    assert (call.indicated, call.called, call.line) == (Fault.INNER, None, "BPFI")
    assert call.sentence.startswith("Doubtful: the record is declared healthy, but its BPFI line is like an inner-race")
    quiet = compare_with_baseline(analyse(healthy(), bearing=BEARING))
    assert (quiet.indicated, quiet.called) == (None, None)
    assert quiet.sentence.startswith("No fault is called: the record is declared healthy and ")
