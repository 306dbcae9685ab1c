"""The report on a user's recordings: the answer first, every line told, no page too many."""

import dataclasses
import functools
import json
import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.cli import main
from srbval.diagnosis.fault_verdict import Finding
from srbval.diagnosis.records import FailedFile, RecordRequest
from srbval.errors import DataError
from srbval.reading.lines import NotDetected
from srbval.recordings import Recording
from srbval.recordings.speed import nominal_speed
from srbval.report.blocks import Report, Tone
from srbval.report.findings.records import first_lines
from srbval.report.findings.user_records import UserRecord, gather_user_records
from srbval.report.reports import write_plot
from srbval.report.sections.user_report import assemble_user_report
from srbval.report.write import write_report
from tests.reading.test_shaft_speed import BEARING, record
from tests.report.test_report_files import unpacked

MOST_PAGES = 5
HOSTILE = "<script>alert(1)</script> \"q\" 's' ../../x {{ 7*7 }} {x} *a* **b** `c` & \x00" + "A" * 500


def faulted(**changes):
    return dataclasses.replace(record(shaft_hz=25.0), **changes)


def healthy(**changes):
    plain = record(shaft_hz=25.0, fault=False, seed=9)
    return dataclasses.replace(plain, state=Fault.HEALTHY, name="healthy one", **changes)


def gathered(*recordings: Recording, healthy: Recording | None = None, **asked: Any) -> tuple[UserRecord, ...]:
    request = RecordRequest(bearing=BEARING.name, auto_band_if_undeclared=True, **asked)
    return gather_user_records(recordings, request, healthy=healthy)[0]


@functools.cache
def compared() -> UserRecord:
    """A faulted record beside a healthy one."""
    return gathered(faulted(), healthy=healthy())[0]


def assembled(*records: UserRecord) -> Report:
    return assemble_user_report(records, command="srbval report", provenance={})


def test_headline_tone_points_and_data_follow_from_the_one_verdict() -> None:
    own, report = compared(), assembled(compared())
    assert own.verdict.finding is Finding.NAMED
    assert report.verdict.tone is Tone.BAD
    assert report.verdict.headline == own.verdict.headline
    assert report.verdict.headline.startswith("Inner race fault: the BPFI line stands")
    assert own.verdict.comparison.sentence in report.verdict.points
    assert len(report.verdict.points) == 3
    assert report.verdict.figure.id == "spectrum-figure"
    assert " ".join(own.verdict.reasons) in report.sections[0].blocks[0].items, "all of them, below"
    entry = report.data["records"][0].to_dict()
    assert entry["fault"] is own.verdict
    assert entry["verdict"] == own.verdict.sentence


def test_two_recordings_are_told_apart_and_the_worst_verdict_comes_first() -> None:
    quiet = dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=4), name="another")
    records = gathered(faulted(), quiet)
    both = assembled(*records)
    limits = next(section for section in both.sections if section.id == "limits")
    assert any("No healthy record was given" in item for item in limits.blocks[0].items)
    assert both.sections[0].id == "overview"
    assert {"record-1", "record-2"} <= {section.id for section in both.sections}
    assert both.verdict.figure.id == "probabilities"
    assert both.verdict.tone is Tone.BAD
    assert both.verdict.headline.startswith("A fault is named in 1 of 2 recordings")


def test_a_healthy_record_shows_no_fault() -> None:
    other = dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=4), name="another")
    report = assembled(*gathered(other, healthy=healthy()))
    assert report.verdict.tone is Tone.GOOD
    assert re.match(r"Nothing found: .* from a modulation of about \d", report.verdict.headline)


def test_every_line_is_either_seen_or_has_a_reason() -> None:
    own = compared()
    unseen = {line.name for line in first_lines(own.analysis) if not line.detected}
    assert unseen == own.to_dict()["unseen"].keys()
    (narrow,) = gathered(faulted(), band_hz=(1000.0, 1100.0))
    assert narrow.to_dict()["unseen"]["BPFI"] is NotDetected.OUT_OF_REACH


def test_another_speed_gives_no_answer_and_the_report_says_why() -> None:
    (own,) = gathered(faulted(), healthy=healthy(speed=nominal_speed(1200.0, 0.5), nominal_rpm=1200.0))
    assert own.baseline.conditions == ("1200 rpm instead of 1500 rpm",)
    assert own.verdict.part is Fault.INNER, "what the record alone shows stays"
    assert any("1200 rpm" in point and "not comparable" in point for point in assembled(own).verdict.points)


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("file", "baseline", "expected", "line"),
    [
        ("cwru/109_IR007_0_48kDE.mat", "cwru/97_Normal_0_48kDE.mat", "Inner race fault", "bpfi"),
        ("mfpt/OuterRaceFault_vload_5.mat", None, "Outer race fault", "bpfo"),
    ],
)
def test_a_published_record_in_five_pages(
    file: str, baseline: str | None, expected: str, line: str, recordings_dir: Path, tmp_path: Path
) -> None:
    more = ["--healthy", str(recordings_dir / baseline)] if baseline else []
    assert main(["report", str(recordings_dir / file), *more, "-o", str(tmp_path), "--json"]) == 0
    found = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert found["headline"]["text"].startswith(expected)
    model = found["records"][0]["model"]
    assert model["model"] == "planar"
    (read,) = (x for x in found["records"][0]["lines"] if x["name"] == line.upper() and x["harmonic"] == 1)
    assert model[f"{line}_hz"] == pytest.approx(read["kinematic_hz"], rel=1e-3)
    assert model["open_cage"]["ci95"] > abs(model["open_cage"]["shift"]) > 0
    assert expected in (tmp_path / "report.html").read_text(encoding="utf-8")
    pages = re.findall(rb"/Type\s*/Page\b", unpacked((tmp_path / "report.pdf").read_bytes()))
    assert 3 <= len(pages) <= MOST_PAGES


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".html", b"<!DOCTYPE html>")])
def test_one_picture_in_each_format(suffix: str, start: bytes, tmp_path: Path) -> None:
    own, path = compared(), tmp_path / f"picture{suffix}"
    write_plot(own, path)
    assert path.read_bytes().startswith(start)
    assert [found.name for found in tmp_path.iterdir()] == [path.name]


def test_hostile_names_of_files_and_channels_are_shown_as_they_are(tmp_path: Path) -> None:
    own = gathered(faulted(name=HOSTILE, channel="x"), healthy=healthy())
    failed = (FailedFile(file=HOSTILE, error=DataError(HOSTILE)),)
    report = assemble_user_report((*own, *own), command=f"srbval report {HOSTILE}", provenance={}, failed=failed)
    page = write_report(report, tmp_path, ("html",))["html"].read_text(encoding="utf-8")
    assert page.count("<script>") == 1, "the page's own"
    text = unescape(re.sub(r"<[^>]*>", "", re.sub(r"<(script|style)>.*?</\1>", "", page, flags=re.DOTALL)))
    assert text.count(HOSTILE.replace("\x00", "\ufffd")) >= 4
