"""Studies stand on their own: each says what it asks, and the rest does without any of them."""

import argparse
import hashlib
from pathlib import Path

import pytest

from srbval.cli import main
from srbval.cli.arguments import Parser
from srbval.errors import ConfigurationError
from srbval.progress import silent
from srbval.recordings.registry import FileStatus, RegisteredRecording
from srbval.storage.stored_result import SHIPPED_INPUT, newest_result
from srbval.studies.harness import (
    FOLDER,
    Study,
    StudyResult,
    input_hashes,
    load_study,
    make_result,
    run_study,
    study_names,
)

ROOT = FOLDER.parents[1]


@pytest.mark.parametrize("name", study_names())
def test_every_study_says_what_it_asks_and_has_options_that_parse(name: str) -> None:
    study = load_study(name)
    assert study.question.endswith("?") or "?" in study.question
    assert study.minutes > 0
    parser = Parser(prog=name)
    study.add_options(parser)
    assert callable(study.run)
    required = [action.option_strings[0] for action in parser._actions if action.required]
    parser.parse_args([word for option in required for word in (option, "x")])


@pytest.mark.parametrize(
    ("command", "name", "function"),
    [("bench", "speed_accuracy", "run_bench"), ("stability", "stability", "run_stability")],
)
def test_a_long_table_is_printed_only_where_it_is_asked_for(
    command: str, name: str, function: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = newest_result(name)
    assert stored is not None
    monkeypatch.setattr(f"srbval.studies.{name}.study.{function}", lambda *_, **__: stored.content)
    assert main([command, "--quick"]) == 0
    *answer, more = capsys.readouterr().out.splitlines()
    assert len(answer) < 15
    assert "--all" in more
    assert main([command, "--quick", "--all"]) == 0
    whole = capsys.readouterr().out.splitlines()
    assert whole[-len(answer) :] == answer
    rows = stored.content.get("runs") or {(one["scene"], one["critical_velocity_m_s"], one["solver"], one["dt_s"])
                                          for one in stored.content["cells"]}  # fmt: skip
    assert len(whole) - len(answer) > len(rows)


def test_what_is_complete_is_stored_and_what_is_not_only_where_a_file_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for name, output, stored in (("fake", None, True), (None, None, False), (None, str(tmp_path / "own.json"), True)):
        result = StudyResult(name=name, content={"rows": [1]}, text="", inputs={"torino/a.mat": "f00"})
        monkeypatch.setattr(Study, "run", property(lambda _, result=result: lambda *_: result))
        options = argparse.Namespace(output=output)
        _, content = make_result("naming", options, silent, command="srbval study run fake")
        assert ("file" in content) is stored
        assert (content["command"], content["rows"]) == ("srbval study run fake", [1])
        assert not stored or (content["inputs_sha256"] == {"torino/a.mat": "f00"} and content["file"].is_file())


def test_inputs_are_named_so_that_those_of_the_program_are_compared_with_its_files(tmp_path: Path) -> None:
    """As `StoredResult.stale` looks for them; another file by its folder and name."""
    own = tmp_path / "torino" / "a.mat"
    own.parent.mkdir()
    own.write_bytes(b"samples")
    entry = RegisteredRecording(file=str(own), sha256="", size_bytes=7, mtime_ns=1, status=FileStatus.OK)
    found = input_hashes(None, newest_result("predictions"), entry)
    assert found["torino/a.mat"] == hashlib.sha256(b"samples").hexdigest()
    assert all(SHIPPED_INPUT.fullmatch(name) or name == "torino/a.mat" for name in found)
    (excerpt,) = (ROOT / "data_manifest" / "rig_excerpts").glob("H_877*.h5")
    assert list(input_hashes(excerpt)) == [f"data_manifest/rig_excerpts/{excerpt.name}"]


def test_unknown_studies_and_options_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="no study is called 'nothing'"):
        run_study("nothing")
    with pytest.raises(ConfigurationError, match="has no option 'colour'"):
        run_study("naming", colour="white")
