"""All files or none, whatever was there before."""

import json

import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.report import write as write_module
from srbval.report.write import write_report


def listing(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


def test_everything_is_written_and_nothing_else(report, tmp_path):
    pytest.importorskip("typst")
    folder = tmp_path / "deep" / "out"
    paths = write_report(report, folder)
    assert listing(folder) == [
        "figures", "figures/fig11b.csv", "figures/fig11b.svg", "figures/fig12a.csv", "figures/fig12a.svg",
        "report.html", "report.json", "report.pdf",
    ]  # fmt: skip
    assert paths["json"] == folder / "report.json"
    assert json.loads(paths["json"].read_text("utf-8"))["table6"][0]["rig_hz"] is None
    assert listing(tmp_path / "deep") == ["out", *(f"out/{name}" for name in listing(folder))]


def test_a_failure_leaves_what_was_there(report, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    write_report(report, folder, ("json",))
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    def fail(*_):
        raise RuntimeError("out of luck")

    monkeypatch.setattr(write_module, "write_json", fail)
    with pytest.raises(RuntimeError):
        write_report(report, folder, ("html", "json"))
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    assert listing(tmp_path) == ["out", *(f"out/{name}" for name in listing(folder))]


def test_an_unknown_format_is_refused_before_anything_is_made(report, tmp_path):
    with pytest.raises(ConfigurationError, match="'docx' is not known"):
        write_report(report, tmp_path / "out", ("html", "docx"))
    assert listing(tmp_path) == []


def test_a_folder_that_cannot_be_made_is_a_data_error(report, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="could not be written"):
        write_report(report, tmp_path / "file" / "out", ("json",))
