from __future__ import annotations

import argparse
import json
from pathlib import Path

import pytest

from srbval.cli.measured import keep_and_print, this_machine
from srbval.storage.stored_result import READING, newest_result


def measured(output: Path | None, *, as_json: bool, whole: bool) -> None:
    options = argparse.Namespace(output=output and str(output), json=as_json)
    keep_and_print(
        READING, {"machine": this_machine()}, options, revision="abc", whole=whole, show=lambda: print("shown")
    )


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda kind: tmp_path / kind)
    return tmp_path / "results"


def test_a_whole_result_is_kept_for_the_report_and_shown(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    measured(None, as_json=False, whole=True)
    said = capsys.readouterr()
    assert said.out == "shown\n"
    assert said.err == f"kept: {cache / 'reading.json'}\n"
    kept = newest_result(READING)
    assert kept is not None
    assert kept.path == cache / "reading.json"
    assert kept.content["machine"]["usable_cores"] >= 1


def test_a_part_is_kept_only_where_asked(cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    measured(None, as_json=True, whole=False)
    assert not cache.exists()
    said = capsys.readouterr()
    assert (json.loads(said.out)["git_revision"], said.err) == ("abc", "")
    measured(tmp_path / "own.json", as_json=True, whole=False)
    assert json.loads((tmp_path / "own.json").read_text())["kind"] == "reading"
    assert not cache.exists()
