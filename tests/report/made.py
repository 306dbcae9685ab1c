"""Whole reports of short runs, and the same findings with names as hostile as a file can carry them."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import srbval
from srbval.reading.analyse import Analysis
from srbval.report.blocks import Report
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordView

PACKAGE = Path(srbval.__file__).parent
SECONDS = 1.2  # enough to read the lines; the report itself runs 10 s
FILES = {"report.html", "report.pdf", "report.json", "figures"}
PANELS = {  # of the paper's Figures 11 to 14
    f"fig{n}{c}" for n, letters in (("11", "abcdef"), ("12", "ab"), ("13", "ab"), ("14", "abcdef")) for c in letters
}
OPTIONS = ("report", "--seconds", str(SECONDS), "--no-pdf", "-o", "made")  # of the same on a command line
TEXT = "<script>alert(1)</script> \"q\" 's' ../../../tmp/x {{ 7*7 }} *a* **b** `c` & \x00 \u202e #panic(1)"
HOSTILE = TEXT + "A" * 10_000


@dataclass(frozen=True)
class Made:
    """A report's findings, its tree and its files."""

    findings: Findings
    report: Report
    files: Mapping[str, Path]

    @property
    def folder(self) -> Path:
        return self.files["json"].parent

    def text(self, kind: str) -> str:
        return self.files[kind].read_text(encoding="utf-8")

    def document(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.text("json"))
        return found


def with_hostile_names(findings: Findings) -> Findings:
    """The findings with every text that a recording may bring replaced by a hostile one."""
    data = findings.data
    return dataclasses.replace(
        findings,
        analyses={side: {s: _renamed(one) for s, one in found.items()} for side, found in findings.analyses.items()},
        views={side: {s: _renamed_view(one) for s, one in found.items()} for side, found in findings.views.items()},
        matrix=dataclasses.replace(
            findings.matrix,
            unusable=((HOSTILE, HOSTILE),),
            records=findings.matrix.records.assign(file=HOSTILE),
        ),
        data={
            **data,
            "cautions": [{"file": HOSTILE, "caution": HOSTILE}],
            "speed_and_slip": [row | {"record": HOSTILE} for row in data["speed_and_slip"]],
            "recordings_not_used": [{"file": HOSTILE, "status": "missing", "reason": HOSTILE}],
            "register_unreadable": HOSTILE,
        },
    )


def _renamed_view(view: RecordView) -> RecordView:
    return dataclasses.replace(view, analysis=_renamed(view.analysis))


def _renamed(analysis: Analysis) -> Analysis:
    recording = dataclasses.replace(analysis.recording, name=HOSTILE, file=HOSTILE, notes=(HOSTILE,))
    return dataclasses.replace(analysis, recording=recording)
