"""Report on a user's recordings: the answer first, every line listed, records of any rate, length and speed."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
import os
import re
from html import unescape
from typing import Any

import numpy as np
import pytest
import scipy.signal

from srbval import DataError, Recording, write_plot
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import RecordReading, RecordRequest, read_record
from srbval.monitoring.batch import FailedFile
from srbval.reading.lines import NotDetected, detected_fault_lines
from srbval.reading.pipeline import LEAST_REVOLUTIONS
from srbval.recordings.speed import stated_speed
from srbval.report.blocks import Report, Tone
from srbval.report.findings.records import first_lines
from srbval.report.findings.user_records import OPEN_CAGE, UserRecord, gather_user_records
from srbval.report.renderers import write_report
from srbval.report.sections.user_report import assemble_user_report
from srbval.signal.envelope import MIN_END_S
from tests.diagnosis.test_baseline import healthy
from tests.reading.test_shaft_speed import BEARING, record
from tests.report.test_report_files import unpacked

MOST_PAGES = 5
HOSTILE = "<script>alert(1)</script> \"q\" 's' ../../x {{ 7*7 }} {x} *a* **b** `c` & \x00" + "A" * 500


def faulted(**changes):
    return dataclasses.replace(record(shaft_hz=25.0), **changes)


def gathered(*recordings: Recording, healthy: Recording | None = None, **asked: Any) -> tuple[UserRecord, ...]:
    requests = [RecordRequest(recording=one, bearing=BEARING.name, healthy=healthy, **asked) for one in recordings]
    return gather_user_records(requests)[0]


@functools.cache
def compared() -> UserRecord:
    """A faulted record beside a healthy one."""
    return gathered(faulted(), healthy=healthy())[0]


def assembled(*records: UserRecord) -> Report:
    return assemble_user_report(records, origin={"command": "srbval report"})


def test_headline_tone_points_and_data_follow_from_the_one_verdict():
    own, report = compared(), assembled(compared())
    assert own.verdict.finding is Finding.NAMED
    assert report.verdict.tone is Tone.BAD
    assert report.verdict.headline == own.verdict.headline
    assert report.verdict.headline.startswith("Inner race fault: the BPFI line is")
    assert own.verdict.comparison.sentence in report.verdict.points
    assert len(report.verdict.points) == 3
    assert report.verdict.figure.id == "spectrum-figure-1"
    assert " ".join(own.verdict.reasons) in report.sections[0].blocks[0].items, "all of them, below"
    entry = report.data["records"][0].to_dict()
    assert (entry["fault"], entry["verdict"]) == (own.verdict, own.verdict.sentence)
    assert {line.name for line in first_lines(own.analysis) if not line.detected} == entry["unseen"].keys()


def test_two_recordings_are_told_apart_and_the_worst_verdict_comes_first():
    quiet = dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=4), name="another")
    both = assembled(*gathered(faulted(), quiet))
    limits = next(section for section in both.sections if section.id == "limits")
    assert any("No healthy record was given" in item for item in limits.blocks[0].items)
    assert both.sections[0].id == "overview"
    assert {"record-1", "record-2"} <= {section.id for section in both.sections}
    assert (both.verdict.figure.id, both.verdict.figure.label) == ("spectrum-figure-1", "made for the test")
    assert both.verdict.tone is Tone.BAD
    assert both.verdict.headline.startswith("A fault is named in 1 of 2 recordings")


def test_a_line_beyond_the_band_s_reach_has_its_reason():
    (narrow,) = gathered(faulted(), band_hz=(1000.0, 1100.0))
    assert narrow.to_dict()["unseen"]["BPFI"] is NotDetected.OUT_OF_REACH


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("file", "baseline", "expected", "line"),
    [
        ("cwru/109_IR007_0_48kDE.mat", "cwru/97_Normal_0_48kDE.mat", "Inner race fault", "bpfi"),
        pytest.param("mfpt/OuterRaceFault_vload_5.mat", None, "Outer race fault", "bpfo", marks=pytest.mark.long_form),
    ],
)
def test_a_published_record_in_five_pages(file, baseline, expected, line, recordings_dir, tmp_path, srbval_text):
    more = ["--healthy", str(recordings_dir / baseline)] if baseline else []
    srbval_text("report", recordings_dir / file, *more, "-o", tmp_path)
    found = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert found["headline"]["text"].startswith(expected)
    model = found["records"][0]["model"]
    assert model["model"] == "planar"
    (read,) = (x for x in found["records"][0]["lines"] if x["name"] == line.upper() and x["harmonic"] == 1)
    assert model[f"{line}_hz"] == pytest.approx(read["kinematic_hz"], rel=1e-3)
    assert model["open_cage"] == OPEN_CAGE
    assert expected in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", unpacked((tmp_path / "report.pdf").read_bytes()))) <= MOST_PAGES


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".html", b"<!DOCTYPE html>")])
def test_one_picture_in_each_format(suffix, start, tmp_path):
    own, path = compared(), tmp_path / f"picture{suffix}"
    write_plot(own, path)
    assert path.read_bytes().startswith(start)
    assert [found.name for found in tmp_path.iterdir()] == [path.name]


def test_hostile_names_of_files_and_channels_are_shown_as_they_are(tmp_path):
    own = gathered(faulted(name=HOSTILE, channel="x"), healthy=healthy())
    failed = (FailedFile(file=HOSTILE, error=DataError(HOSTILE)),)
    report = assemble_user_report((*own, *own), origin={"command": f"srbval report {HOSTILE}"}, failed=failed)
    page = write_report(report, tmp_path, ("html",))["html"].read_text(encoding="utf-8")
    assert page.count("<script>") == 1, "the page's own"
    text = unescape(re.sub(r"<[^>]*>", "", re.sub(r"<(script|style)>.*?</\1>", "", page, flags=re.DOTALL)))
    assert text.count(HOSTILE.replace("\x00", "\ufffd")) >= 4


def read(recording: Recording) -> RecordReading:
    return read_record(RecordRequest(recording=recording, bearing=BEARING.name))


RATES_HZ, MORE_RATES_HZ = (2000.0, 102_400.0), (8192.0, 12_000.0, 48_000.0)
SECONDS = (0.25, 1.5, 4.0)
SPEEDS_RPM, MORE_SPEEDS_RPM = (30.0, 300.0, 1200.0, 3000.0), (120.0, 600.0, 6000.0)
MOSTLY = 0.8  # of the records that are long enough: at 2 kHz and 6,000 rpm the line is beyond reach


def outer_race(fs_hz: float, seconds: float, rpm: float) -> Recording:
    """Impacts at BPFO that ring at three tenths of the sampling rate, in noise."""
    samples = 0.1 * np.random.default_rng(0).standard_normal(round(fs_hz * seconds))
    hits = np.zeros(samples.size)
    hits[(np.arange(0.003, seconds, 60 / rpm / BEARING.orders.bpfo) * fs_hz).astype(int)] = 1.0
    step = np.arange(round(0.02 * fs_hz))
    found = samples + scipy.signal.fftconvolve(hits, np.exp(-0.015 * step) * np.sin(0.6 * np.pi * step))[: samples.size]
    own = {"fs_hz": fs_hz, "channels": {"x": found}, "speed": stated_speed(rpm, min(1.0, 0.02 * rpm))}
    return faulted(state=None, nominal_rpm=None, band_hz=None, **own)


@pytest.mark.parametrize(
    "fs_hz", [*RATES_HZ, *(pytest.param(rate, marks=pytest.mark.long_form) for rate in MORE_RATES_HZ)]
)
def test_each_rate_length_and_speed_gives_a_report_or_a_true_reason(fs_hz):
    found, more = [], MORE_SPEEDS_RPM if os.environ.get("SRBVAL_TESTS") == "all" else ()
    for seconds, rpm in itertools.product(SECONDS, (*SPEEDS_RPM, *more)):
        if round((seconds - 2 * MIN_END_S) * rpm / 60, 1) >= LEAST_REVOLUTIONS:
            own = read(outer_race(fs_hz, seconds, rpm))
            found.append([line.name for line in detected_fault_lines(own.analysis.lines)])
            assert found[-1] in ([], ["BPFO"]), (seconds, rpm)
            continue
        with pytest.raises(DataError, match=f"at least {LEAST_REVOLUTIONS} revolutions are needed") as refused:
            read(outer_race(fs_hz, seconds, rpm))
        wanted = re.search(r"Record at least ([\d.]+) s", str(refused.value))
        assert wanted
        if rpm in (300, 3000):
            own = read(outer_race(fs_hz, 1.01 * float(wanted[1]), rpm))
            assert own.analysis.lines
    assert found.count(["BPFO"]) >= MOSTLY * len(found)
