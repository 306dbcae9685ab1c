"""Whole reports of short runs, and the same findings with names as hostile as a file can carry them."""

import dataclasses
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, TypeVar

import pytest

import srbval
from srbval.reading.analyse import Analysis
from srbval.report.blocks import Report
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordKurtogram, RecordView
from srbval.report.sections.assemble import assemble

PACKAGE = Path(srbval.__file__).parent
View = TypeVar("View", RecordView, RecordKurtogram)
SECONDS = 1.2  # enough to read the lines; the report itself runs 10 s
FILES = {"report.html", "report.pdf", "report.json", "appendix.html", "appendix.pdf", "figures"}
PANELS = {  # of the paper's Figures 11 to 14
    f"fig{n}{c}" for n, letters in (("11", "abcdef"), ("12", "ab"), ("13", "ab"), ("14", "abcdef")) for c in letters
}
OPTIONS = ("report", "--seconds", str(SECONDS), "--appendix", "--no-pdf", "-o", "made")  # of the same on a command line
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
        kurtograms=tuple(_renamed_view(record) for record in findings.kurtograms),
        matrix=dataclasses.replace(
            findings.matrix,
            unusable=((HOSTILE, HOSTILE),),
            cells=tuple(dataclasses.replace(cell, file=HOSTILE) for cell in findings.matrix.cells),
        ),
        data={
            **data,
            "cautions": [{"file": HOSTILE, "caution": HOSTILE}],
            "speed_and_slip": [dataclasses.replace(s, record=HOSTILE) for s in data["speed_and_slip"]],
            "recordings_not_used": [{"file": HOSTILE, "status": "missing", "reason": HOSTILE}],
            "register_unreadable": HOSTILE,
        },
    )


def functions_called(findings: Findings) -> set[tuple[str, str]]:
    """The functions (room, qualified name) that the report's room calls to word `findings` and to draw the figures.

    What writes a picture is left out: it makes millions of calls of matplotlib's.
    """
    calls: set[tuple[CodeType, CodeType]] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_back is not None:
            calls.add((frame.f_back.f_code, frame.f_code))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.report.figures.style.save_panel", lambda *_: None)
        sys.setprofile(note)
        try:
            for figure in assemble(findings, command="srbval report").figures():
                figure.draw(Path(), figure.id)
        finally:
            sys.setprofile(None)
    # What the report itself calls, directly or through another package (templates).
    called = {_function(called) for caller, called in calls if _function(caller)[0] in ("report", "")}
    return {(room, name) for room, name in called if room}


def _function(code: CodeType) -> tuple[str, str]:
    """Room and qualified name of a function of the package; of another package's without a room."""
    try:
        return Path(code.co_filename).relative_to(PACKAGE).parts[0], code.co_qualname
    except ValueError:
        return "", ""


def _renamed_view(view: View) -> View:
    return dataclasses.replace(view, analysis=_renamed(view.analysis))


def _renamed(analysis: Analysis) -> Analysis:
    recording = dataclasses.replace(analysis.recording, name=HOSTILE, file=HOSTILE, notes=(HOSTILE,))
    return dataclasses.replace(analysis, recording=recording)
