"""Every study states its question and options; results are stored as the options ask."""

import argparse
import re

import pytest

from srbval.check import PROBES
from srbval.cli.arguments import build_parser
from srbval.errors import ConfigurationError
from srbval.progress import silent
from srbval.storage.stored_result import ResultKind
from srbval.studies.harness import STUDIES_FOLDER, Study, StudyResult, load_study, make_result, run_study, study_names


@pytest.mark.parametrize("name", study_names())
def test_every_study_states_its_question_and_has_options_that_parse(name):
    study = load_study(name)
    assert study.question.endswith("?") or "?" in study.question
    assert set(study.parts) <= set(PROBES)
    texts = [path.read_text() for path in (STUDIES_FOLDER / name).glob("*.py") if path.stem != "page"]
    texts += [(STUDIES_FOLDER / "bench.py").read_text()] if "studies.bench" in "".join(texts) else []
    used = set(re.findall(r"^from srbval\.(\w+)", "\n".join(texts), re.MULTILINE)) & set(PROBES)
    assert used <= set(study.parts), "a change of behaviour would not make it stale"
    assert study.parts or study.kind is not ResultKind.EVIDENCE
    assert callable(study.run)
    assert build_parser().parse_args(["study", "run", name]).action == name
    assert set(study.defaults().values()) <= {None}, "no option has to be stated, and none changes the stored result"


def test_a_complete_result_is_stored_and_a_part_only_if_a_file_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    own = study_names()[0]
    monkeypatch.setattr("srbval.studies.harness.load_study", lambda _: Study(name=own, question="?"))
    for name, output, stored in ((own, None, True), (None, None, False), (None, str(tmp_path / "own.json"), True)):
        result = StudyResult(name=name, content={"rows": [1]}, text="")
        monkeypatch.setattr(Study, "run", property(lambda _, result=result: lambda *_: result))
        _, content = make_result(own, argparse.Namespace(output=output), silent, command="srbval study run fake")
        assert ("file" in content) is stored
        assert (content["command"], content["rows"], content["kind"]) == ("srbval study run fake", [1], own)
        assert not stored or content["file"].is_file()


def test_unknown_studies_and_options_are_refused():
    with pytest.raises(ConfigurationError, match="no study is called 'nothing'"):
        run_study("nothing")
    with pytest.raises(ConfigurationError, match="has no option 'colour'"):
        run_study("naming", colour="white")
