"""The report on a user's recordings: the answer first, every line told, no page too many."""

import dataclasses
import functools
import json
import re
from pathlib import Path
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.cli import main
from srbval.diagnosis.baseline import OTHER_CONDITIONS
from srbval.errors import ConfigurationError
from srbval.recordings import Recording
from srbval.recordings.speed import nominal_speed
from srbval.report.blocks import Report, Tone
from srbval.report.findings.records import first_lines
from srbval.report.findings.user_records import NotDetected, UserRecord, gather_user_records
from srbval.report.reports import write_plot
from srbval.report.sections.user_report import assemble_user_report
from tests.reading.test_shaft_speed import BEARING, record
from tests.report.test_report_files import unpacked

MOST_PAGES = 5


def faulted(**changes):
    return dataclasses.replace(record(shaft_hz=25.0), **changes)


def healthy(**changes):
    plain = record(shaft_hz=25.0, fault=False, seed=9)
    return dataclasses.replace(plain, state=Fault.HEALTHY, name="healthy one", **changes)


def gathered(*recordings: Recording, **options: Any) -> tuple[UserRecord, ...]:
    return gather_user_records(recordings, bearing=BEARING.name, **options)[0]


@functools.cache
def compared() -> UserRecord:
    """A faulted record beside a healthy one."""
    return gathered(faulted(), healthy=healthy())[0]


def assembled(*records: UserRecord) -> Report:
    return assemble_user_report(records, command="srbval report", provenance={})


def test_against_a_healthy_record_the_fault_is_named_first_with_its_probability() -> None:
    own, report = compared(), assembled(compared())
    assert report.verdict.tone is Tone.BAD
    assert report.verdict.headline.startswith("Inner race fault: the BPFI line stands")
    assert report.data["records"][0].call.called is Fault.INNER
    assert own.naming is not None
    assert own.naming.state == "inner"
    said = next(point for point in report.verdict.points if "By the record alone" in point)
    words = {"outer": "outer race", "inner": "inner race", "roller": "rolling element", "other": "something else"}
    for name, share in own.naming.probabilities.items():
        assert f"{words.get(name, name)} {100 * share:.0f} %" in " ".join(said.split())
    assert "Named: inner race" in said


def test_a_shallow_line_that_nothing_else_names_leaves_the_part_open(monkeypatch: pytest.MonkeyPatch) -> None:
    own = compared()
    assert own.naming is not None
    doubted = dataclasses.replace(own, naming=dataclasses.replace(own.naming, state="undecided"))
    for deep, said in ((True, "Inner race fault"), (False, "Fault, perhaps of the inner race")):
        monkeypatch.setattr("srbval.report.findings.user_records.is_fault_like", lambda *_, deep=deep: deep)
        assert assembled(doubted).verdict.headline.startswith(f"{said}: the BPFI line")


def test_without_one_a_line_is_a_sign_no_fault_is_called_and_two_recordings_are_told_apart() -> None:
    own, other = records = gathered(faulted(), faulted(name="the other"))
    report = assembled(own)
    assert report.verdict.tone is Tone.WARNING
    assert report.verdict.headline.startswith("Sign of a fault of the inner race")
    assert own.call.called is other.call.called is None
    limits = next(section for section in report.sections if section.id == "limits")
    assert any("No healthy record was given" in item for item in limits.blocks[0].items)
    both = assembled(*records)
    assert both.sections[0].id == "overview"
    assert {"spectrum-1", "spectrum-2"} <= {section.id for section in both.sections}
    assert both.verdict.headline == "Signs of a fault in 2 of 2 recordings"


def test_a_healthy_record_shows_no_fault() -> None:
    other = dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=4), name="another")
    assert assembled(*gathered(other, healthy=healthy())).verdict.headline.startswith("No fault is called")


def test_every_line_is_either_seen_or_has_a_reason() -> None:
    own = compared()
    seen = {line.name for line in first_lines(own.analysis) if line.detected}
    unseen = [line.name for line, _ in own.not_detected]
    assert sorted([*seen, *unseen]) == ["2xBSF", "BPFI", "BPFO", "FTF"]
    (narrow,) = gathered(faulted(), band_hz=(1000.0, 1100.0))
    assert {line.name: why for line, why in narrow.not_detected}["BPFI"] is NotDetected.OUT_OF_REACH


def test_under_other_conditions_the_interval_is_wider_and_the_report_says_why() -> None:
    (own,) = gathered(faulted(), healthy=healthy(speed=nominal_speed(1200.0, 0.5), nominal_rpm=1200.0))
    assert own.call.ratio is not None
    assert own.call.ratio_ci95 is not None
    assert own.call.ratio / own.call.ratio_ci95[0] >= OTHER_CONDITIONS
    assert own.baseline is not None
    assert own.baseline.conditions == ("1200 rpm instead of 1500 rpm",)
    assert any("Less certain" in point and "1200 rpm" in point for point in assembled(own).verdict.points)


def test_the_record_itself_is_no_baseline() -> None:
    with pytest.raises(ConfigurationError, match="record itself"):
        gathered(faulted(sha256="a"), healthy=healthy(sha256="a"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["report", "--healthy", "healthy.csv"], "name it too"),
        (["analyse", "nowhere.csv", "--plot", "picture.tiff"], ".png, .svg, .html"),
    ],
)
def test_options_that_fit_nothing_are_refused_before_anything_is_read(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    assert message in capsys.readouterr().err


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("file", "baseline", "expected", "line"),
    [
        ("cwru/109_IR007_0_48kDE.mat", "cwru/97_Normal_0_48kDE.mat", "Inner race fault", "bpfi"),
        ("mfpt/OuterRaceFault_vload_5.mat", None, "Sign of a fault of the outer race", "bpfo"),
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
    write_plot(own.analysis, path, baseline=own.baseline)
    assert path.read_bytes().startswith(start)
    assert [found.name for found in tmp_path.iterdir()] == [path.name]
