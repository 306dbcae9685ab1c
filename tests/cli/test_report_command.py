"""`srbval report` ends with exit code 1 where a stated tolerance is missed, and says by how much."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

import srbval.report.reports
from srbval.bearing import Fault
from srbval.cli import main
from srbval.comparison.budget import TOLERANCE
from srbval.comparison.headline import Headline, RecordError


@pytest.mark.parametrize(("times", "code"), [(0.1, 0), (0.9, 0), (1.1, 0), (2.0, 1)])
def test_only_a_tolerance_that_is_surely_missed_ends_with_1(
    times: float, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    limit = TOLERANCE.limit_pct
    one = RecordError(
        record="r", state=Fault.OUTER, scene="paper", error_pct=times * limit, uncertainty_pct=0.5 * limit
    )
    found = Headline(quantity="cage ratio", tolerance=TOLERANCE, errors=(one,), rig_scene=())
    findings = SimpleNamespace(headline=found, data={"table6": ()})
    monkeypatch.setattr(srbval.report.reports, "make_report", lambda *_, **__: (findings, {}))
    assert main(["report", "-o", str(tmp_path / "out"), "--json"]) == code
    said = json.loads(capsys.readouterr().out)["headline"]
    assert said["holds"] is (code == 0)
    assert said["errors"][0]["error_pct"] == pytest.approx(times * limit)
    assert said["tolerance"]["reason"]
