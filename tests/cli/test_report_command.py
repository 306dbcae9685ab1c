"""`srbval report` ends with exit code 1 where a stated tolerance is missed, and says by how much."""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import srbval.report.reports
from srbval.comparison.verdicts import holds
from srbval.comparison.vocabulary import Verdict


@pytest.mark.parametrize(("verdict", "code"), [(Verdict.MET, 0), (Verdict.NOT_RESOLVED, 0), (Verdict.MISSED, 1)])
def test_only_a_tolerance_that_is_missed_ends_with_1(verdict, code, tmp_path, monkeypatch, srbval_json):
    rows = [{"endpoint": "e", "verdict": verdict.value}]
    findings = SimpleNamespace(data={"table6": (), "headline": {"holds": holds(rows), "verdicts": rows}})
    monkeypatch.setattr(srbval.report.reports, "make_report", lambda *_, **__: (findings, {}))
    said = srbval_json("report", "-o", tmp_path / "out", code=code)["headline"]
    assert said["holds"] is (code == 0)
    assert said["verdicts"][0]["verdict"] == verdict


GIVEN = ["--bearing", "b.toml", "--rpm", "1500", "--fs", "10000", "--unit", "g", "--band", "1000", "3000", "--no-pdf"]


@pytest.fixture
def _in_a_folder_with_a_bearing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    orders = "rolling_elements = 9\nbpfo = 3.585\nbpfi = 5.415\nbsf = 2.357\nftf = 0.398\n"
    Path("b.toml").write_text(f'title = "b"\nsource = "s"\n[orders]\n{orders}')


@pytest.mark.usefixtures("_in_a_folder_with_a_bearing")
def test_one_bad_file_does_not_end_a_batch(srbval_json, srbval_text):
    """The others get their report, in a folder of their name, which says what is not in it and why."""
    for seed, name in enumerate(("one.csv", "two.csv", "short.csv")):
        np.savetxt(name, np.random.default_rng(seed).normal(size=30_000 if len(name) < 8 else 30), fmt="%.5f")
    Path("text.csv").write_text("no number\n")
    found = srbval_json("report", "text.csv", "one.csv", "short.csv", "two.csv", *GIVEN, code=3)
    assert (found["status"], [Path(r["file"]).name for r in found["records"]]) == ("incomplete", ["one.csv", "two.csv"])
    assert sorted(Path(f["file"]).name for f in found["failed"]) == ["short.csv", "text.csv"]
    page = Path("srbval-report-text-and-3-more/report.html").read_text(encoding="utf-8")
    assert all(one["file"] in page for one in found["failed"])
    srbval_text("report", "one.csv", *GIVEN)
    assert Path("srbval-report-one/report.json").is_file()
    before = set(os.listdir())
    said = srbval_text("report", "text.csv", "short.csv", *GIVEN, code=3).err
    assert "none of the recordings can be reported: text.csv: " in said
    for one in found["failed"]:
        assert f"{one['file']}: {one['reason']}" in said
    assert set(os.listdir()) == before


@pytest.mark.usefixtures("_in_a_folder_with_a_bearing")
def test_a_folder_has_a_row_for_each_record_and_sections_for_the_most_serious(srbval_json):
    Path("fan").mkdir()
    for seed in range(8):
        samples = np.random.default_rng(seed).normal(size=30_000)
        since = np.mod(np.arange(samples.size) / 10_000, 1 / (3.585 * 25))
        np.save(f"fan/{seed}.npy", samples + 20 * (seed in (2, 5)) * np.exp(-900 * since) * np.sin(12_566 * since))
    Path("fan/bad.npy").write_bytes(b"")
    found = srbval_json("report", "fan", *GIVEN, code=3)
    alarms = [one["fault"]["verdict"] != "nothing found" for one in found["records"]]
    assert (len(alarms), [Path(one["file"]).name for one in found["failed"]]) == (8, ["bad.npy"])
    assert alarms == sorted(alarms, reverse=True)
    assert {Path(one["file"]).stem for one in found["records"][:2]} == {"2", "5"}
    page = Path("srbval-report-fan/report.html").read_text(encoding="utf-8")
    assert page.count('id="spectrum-figure-') == min(6, sum(alarms)) < 8
    assert "The first" in page
