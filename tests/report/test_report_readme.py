"""The table in the README is that of a report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from srbval.report.reports import MadeReport
from tests.readme_table import in_readme, readme_table


@pytest.mark.recordings
def test_the_table_in_the_readme_is_that_of_a_report(with_rig: tuple[MadeReport, Path]) -> None:
    report = json.loads(with_rig[0].files["json"].read_text(encoding="utf-8"))
    assert in_readme() == readme_table(report)
    report["headline"]["errors"][0]["error_pct"] += 0.01
    assert in_readme() != readme_table(report)
