"""Stored starts of the counterparts stand for what would be simulated, and for nothing else."""

import pytest

from srbval.bearing import DEFECTS, load_bearing
from srbval.comparison import counterpart
from srbval.comparison.counterpart import COUNTERPARTS, counterpart_cases, start_key, start_values, stored_starts
from srbval.reading.analyse import analyse
from srbval.recordings.registry import load_entry
from srbval.recordings.registry.register import shipped_recordings
from srbval.storage.content_store import FRESH
from srbval.storage.stored_result import StoredResult, newest_result

BEARING = load_bearing("skf-22240")
CLOSE = {"cage ratio": 2e-4, "dB": 3.0}  # what another processor's last digits may grow to: the scatter of starts


def test_stored_starts_are_those_of_the_records_and_what_would_be_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    result = newest_result(COUNTERPARTS)
    assert result is not None
    if result.stale:  # then none is used, which the next test shows
        pytest.skip(f"{COUNTERPARTS}.json is to be stored again: {result.stale}")
    records = [one for one in shipped_recordings() if one.state in DEFECTS]
    of_records = [counterpart_cases(analyse(load_entry(one), bearing=BEARING)) for one in records]
    known = result.content["starts"]
    assert set(known) == {start_key(case, BEARING) for _, *others in of_records for case in others}
    case = of_records[0][1]
    own = start_values(case, BEARING)
    assert own.keys() == known[start_key(case, BEARING)].keys()
    for name, value in known[start_key(case, BEARING)].items():
        assert own[name]["value"] == pytest.approx(value["value"], abs=CLOSE.get(name, CLOSE["dB"]))
    assert stored_starts(result) == known
    monkeypatch.setenv(FRESH, "1")
    assert stored_starts(result) == {}


def test_a_stored_start_is_not_simulated_but_one_of_another_scene_is(monkeypatch: pytest.MonkeyPatch) -> None:
    case = counterpart.paper_cases(1.0)[1]
    known = {start_key(case, BEARING): {"cage ratio": {"value": 0.43}}}
    monkeypatch.setattr(counterpart, "run_case", lambda *_, **__: pytest.fail("simulated"))
    assert start_values(case, BEARING, stored=known)["cage ratio"]["value"] == 0.43
    with pytest.raises(pytest.fail.Exception):
        start_values(counterpart.paper_cases(1.1)[1], BEARING, stored=known)
    stale = StoredResult(path=newest_result(COUNTERPARTS).path, content={"starts": known, "git_revision": "1-dirty"})
    assert stored_starts(stale) == {}
