"""Records of minutes: read in parts in bounded memory, with an answer that does not contradict itself."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.diagnosis.long_records import LongAnalysis, analyse_by_parts
from srbval.diagnosis.records import RecordRequest, read_record
from srbval.reading.analyse import analyse
from srbval.reading.features import features_of
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource, load_recording, raw
from srbval.recordings.reading import sample_cautions
from srbval.recordings.speed import stated_speed
from srbval.storage.json_files import to_json
from tests.recordings.synthetic_record import FS_HZ, vibration

BEARING = load_bearing("skf-22240")
SHAFT_HZ = 12.0
SECONDS = 50.0  # of a record that is read in five parts
WALK = 2e-3  # RMS of the speed's walk over the record, relative: 100 s of an hour in which it walks by 1 %


def record(seconds: float, state: Fault = Fault.OUTER, *, within=(0.0, 1.0)) -> Recording:
    """A record whose speed walks by `WALK`, with the fault from one to another share of its duration."""
    rng = np.random.default_rng(3)
    course = np.cumsum(rng.standard_normal(round(10 * seconds)))
    course = 1 + WALK * (course - course.mean()) / course.std()
    at_s = np.arange(round(seconds * FS_HZ)) / FS_HZ
    turns = SHAFT_HZ * np.interp(at_s, np.arange(course.size) / 10, np.cumsum(course) / 10)
    signal = vibration(Fault.HEALTHY, BEARING.orders, turns, rng)
    first, end = (round(share * at_s.size) for share in within)
    signal[first:end] = vibration(state, BEARING.orders, turns[first:end] - turns[first], rng)
    stated = {"speed": stated_speed(60 * SHAFT_HZ, 1.0), "fs_hz": FS_HZ, "unit": "m/s2"}
    return Recording(name="x", origin=Origin.MEASURED, channel="x", channels={"x": signal}, **stated)


@pytest.mark.parametrize(
    ("state", "within"), [(Fault.OUTER, (0.0, 1.0)), (Fault.OUTER, (0.6, 0.8)), (Fault.HEALTHY, (0.0, 1.0))]
)
def test_headline_lines_and_probabilities_of_a_long_record_agree(state, within):
    found = read_record(RecordRequest(recording=record(SECONDS, state, within=within), bearing="skf-22240"))
    analysis, verdict = found.analysis, found.verdict
    line = analysis.line("BPFO")
    assert isinstance(analysis, LongAnalysis)
    assert analysis.parts == 5
    if state is Fault.HEALTHY:
        assert not line.detected
        assert not verdict.parts
        return
    assert verdict.parts == (Fault.OUTER,)
    assert line.detected
    assert f"BPFO line is {line.snr:,.0f} times" in verdict.headline
    assert verdict.diagnosis.probabilities["outer"] > 0.9
    assert within[0] <= analysis.first_s / SECONDS < within[1]
    assert to_json(found)["long_record"]["as_clear"] == (2 if within == (0.0, 1.0) else 1)


def test_a_short_record_is_read_as_a_whole_and_features_of_parts_are_those_of_the_whole():
    short, long = record(25.0), record(40.0)
    assert to_json(analyse_by_parts(short, BEARING)) == to_json(analyse(short, bearing=BEARING))
    both = analyse_by_parts(long, BEARING), analyse(long, bearing=BEARING, whole_band=True)
    found, whole = map(features_of, both)
    names = ("rms", "peak", "kurtosis")
    assert [found[name] for name in names] == pytest.approx([whole[name] for name in names], rel=1e-3)


def test_parts_without_vibration_are_left_out_and_stated():
    stopped = record(40.0)
    stopped.channels["x"][: round(20 * FS_HZ)] = 0.0
    found = read_record(RecordRequest(recording=stopped, bearing="skf-22240"))
    assert found.verdict.parts == (Fault.OUTER,)
    assert [one for one in found.analysis.recording.cautions if one.startswith("left out: 2 of 4 parts")]


def test_combs_of_parts_are_searched_within_the_spread_of_a_speed_without_its_course():
    speed = ShaftSpeed(value_hz=1.02 * SHAFT_HZ, ci95_hz=0.01, source=SpeedSource.TACHOMETER, spread_hz=0.24)
    found = read_record(RecordRequest(recording=replace(record(SECONDS), speed=speed), bearing="skf-22240"))
    assert found.verdict.parts == (Fault.OUTER,)


def test_memory_does_not_grow_with_the_record():
    """Beside the samples a minute needs no more than 20 s, which are read as a whole."""
    peaks = []
    for seconds in (20.0, 60.0):
        own = record(seconds)
        own = replace(own, channels={"x": own.channels["x"].astype(np.float32)})
        tracemalloc.start()
        analyse_by_parts(own, BEARING)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0]


def test_a_text_too_long_to_be_read_as_a_whole_is_refused_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr("srbval.recordings.loaders.text.LARGEST_TEXT", 1000)
    (tmp_path / "long.csv").write_text("acc [g]\n" + "0.125\n" * 300)
    with pytest.raises(raw.DataError, match=r"reading takes 40 times.*Export it as \.npy"):
        load_recording(tmp_path / "long.csv", fs_hz=1e4, rpm=600.0)


def test_a_long_file_is_mapped_and_looked_at_in_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(raw, "LONG_SAMPLES", 2**16)
    monkeypatch.setattr("srbval.recordings.reading.LONG_SAMPLES", 2**16)
    samples = np.clip(np.random.default_rng(0).standard_normal(3 * 2**16), -2.5, 2.5).astype(np.float32)
    np.save(tmp_path / "long.npy", samples)
    assert load_recording(tmp_path / "long.npy", fs_hz=1e4, unit="g", rpm=600.0).channels["data"].dtype == np.float32
    held = load_recording(tmp_path / "long.npy", fs_hz=1e4, unit="m/s2", rpm=600.0)
    assert not held.channels["data"].flags.owndata, "the file's own pages"
    assert "in the block from sample 0 on" in "".join(sample_cautions(samples))
    samples[2**17 + 5] = np.nan
    np.save(tmp_path / "long.npy", samples)
    with pytest.raises(raw.DataError, match=f"sample {2**17 + 5} of"):
        load_recording(tmp_path / "long.npy", fs_hz=1e4, unit="g", rpm=600.0)
