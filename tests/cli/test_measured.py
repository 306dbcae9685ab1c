"""Measuring commands stamp, store and print their results in one way."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import pytest

from srbval.cli.measured import measure_and_print
from srbval.progress import Progress
from srbval.storage.stored_result import READING, newest_result


def measured(output: Path | None, *, as_json: bool, complete: bool) -> None:
    options = argparse.Namespace(command="bench", output=output and str(output), json=as_json)

    def measure(progress: Progress) -> dict[str, float]:
        progress("count", 1.0)
        return {"value": 2.0}

    result = measure_and_print(READING, options, measure, complete=complete, show=lambda _: print("shown"))
    assert result == {"value": 2.0}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda kind: tmp_path / kind)
    return tmp_path / "results"


def test_a_complete_result_is_stored_for_the_report_and_shown(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    measured(None, as_json=False, complete=True)
    printed = capsys.readouterr()
    assert printed.out == "shown\n"
    assert printed.err.splitlines()[0] == "Bench: count ..."
    assert printed.err.splitlines()[-1] == f"stored: {cache / 'reading.json'}"
    stored = newest_result(READING)
    assert stored is not None
    assert stored.path == cache / "reading.json"
    assert stored.content["value"] == 2.0
    assert stored.content["machine"]["usable_cores"] >= 1


def test_a_part_is_stored_only_where_asked(cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    measured(None, as_json=True, complete=False)
    assert not cache.exists()
    document = json.loads(capsys.readouterr().out)
    assert (document["kind"], document["value"]) == ("reading", 2.0)
    assert "file" not in document
    measured(tmp_path / "own.json", as_json=True, complete=False)
    assert json.loads((tmp_path / "own.json").read_text())["kind"] == "reading"
    assert json.loads(capsys.readouterr().out)["file"] == str(tmp_path / "own.json")
    assert not cache.exists()
