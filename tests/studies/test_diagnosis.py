"""The bench of fault naming: which records, by which methods, how they are counted."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.errors import DataError
from srbval.recordings import Recording
from srbval.recordings.registry import FileStatus, RegisteredRecording, listing
from srbval.studies.diagnosis.simple_diagnosis import THRESHOLD, strongest_line
from srbval.studies.diagnosis.study import CALLED, NAMED, Judged, Named, confusions, judge, wilson
from srbval.studies.known_state import KnownRecord, known_records
from tests.reading.test_shaft_speed import BEARING, record

BAND_HZ = (2000.0, 5000.0)


def plain(recording: Recording) -> Fault | None:
    assert recording.speed is not None
    return strongest_line(recording, BEARING, recording.speed, recording.band_hz or BAND_HZ)


def test_simple_diagnosis_names_the_line_that_is_there_and_nothing_in_noise() -> None:
    assert plain(record(shaft_hz=25.0)) is Fault.INNER
    noise = record(shaft_hz=25.0, fault=False)
    rng = np.random.default_rng(3)
    silent = dataclasses.replace(noise, channels={"x": rng.standard_normal(noise.samples)})
    assert plain(silent) is None


def test_the_threshold_is_over_the_neighbourhood_s_median() -> None:
    """A record whose noise drowns the line names nothing, whatever the line's own amplitude is."""
    shown = record(shaft_hz=25.0)
    rng = np.random.default_rng(4)
    drowned = shown.channels["x"] + 30 * shown.channels["x"].std() * rng.standard_normal(shown.samples)
    assert THRESHOLD == 5
    assert plain(dataclasses.replace(shown, channels={"x": 1000 * drowned})) is None


@pytest.mark.parametrize(("count", "of", "low", "high"), [(8, 10, 0.490, 0.943), (0, 9, 0.0, 0.299), (9, 9, 0.701, 1)])
def test_wilson_s_interval(count: int, of: int, low: float, high: float) -> None:
    """By the printed formula, worked out by hand."""
    assert wilson(count, of) == pytest.approx((low, high), abs=5e-4)
    assert wilson(0, 0) is None


def judged(dataset: str, state: Fault, named: Fault | None, called: Fault | None = None) -> Judged:
    return Judged(
        method="m", dataset=dataset, rig=dataset, file="f", channel=None, state=state, named=named, called=called,
        seconds=0.1,
    )  # fmt: skip


def test_judgements_are_counted_by_state_and_data_set() -> None:
    rows = list(
        confusions(
            [
                judged("a", Fault.OUTER, Fault.OUTER, Fault.OUTER),
                judged("a", Fault.INNER, Fault.OUTER),
                judged("b", Fault.ROLLER, None),
                judged("b", Fault.HEALTHY, Fault.INNER),
                judged("b", Fault.HEALTHY, None),
            ]
        )
    )
    found = {(row.answer, row.dataset): row for row in rows}
    assert set(found) == {(answer, name) for answer in (NAMED, CALLED) for name in ("all", "a", "b")}
    whole = found[NAMED, "all"]
    assert (whole.faulty, whole.right, whole.wrong, whole.silent) == (3, 1, 1, 1)
    assert (whole.healthy, whole.alarms, whole.rigs) == (2, 1, 2)
    assert whole.counts[Fault.INNER] == {"nothing": 0, "outer": 1, "inner": 0, "roller": 0}
    assert (found[CALLED, "all"].right, found[CALLED, "all"].silent, found[CALLED, "b"].alarms) == (1, 2, 0)


def test_what_a_method_refuses_is_said_nothing_of() -> None:
    class Known(KnownRecord):
        def load(self) -> tuple[Recording, Bearing]:
            return record(shaft_hz=25.0), BEARING

    def refuses(*_: object) -> Named:
        raise DataError("too short.")

    entry = dataclasses.replace(entry_like(), dataset="cwru")
    (one,) = judge([Known(entry=entry, state=Fault.INNER)], {"refuses": refuses})
    assert (one.named, one.called) == (None, None)
    assert "too short" in one.refused


def entry_like() -> RegisteredRecording:
    return RegisteredRecording(file="/x/a.mat", sha256="", size_bytes=1, mtime_ns=1, status=FileStatus.OK)


@pytest.mark.recordings
def test_shared_records_of_known_state(recordings_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    records = known_records(listing().recordings)
    assert {r.state for r in records} == {Fault.HEALTHY, *DEFECTS}
    assert len({r.rig for r in records}) >= 5
    ims = [r for r in records if r.entry.dataset == "ims"]
    assert all(r.state is Fault.HEALTHY and r.load()[0].channel == r.entry.channel for r in ims[:2])
    assert all(r.load()[0].state is None for r in records[:3])
