"""Whole reports of short runs, and the same evidence with names as hostile as a file can carry them."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import TypeVar

import numpy as np
from scipy.io import savemat

import srbval
from srbval.bearing import Fault
from srbval.comparison.other_rigs import OtherRecord
from srbval.reading.analyse import Analysis
from srbval.reading.shown_record import ShownRecord
from srbval.recordings.datasets.description import dataset
from srbval.recordings.registry import FileStatus, RegisteredRecording
from srbval.report import Report
from srbval.report.findings.bands import RecordKurtogram
from srbval.report.findings.findings import Evidence
from srbval.report.sections.assemble import assemble
from srbval.report.write import write_report

PACKAGE = Path(srbval.__file__).parent
Record = TypeVar("Record", ShownRecord, RecordKurtogram)
SECONDS = 1.2  # enough to read the lines; the report itself runs 10 s
FILES = {"report.html", "report.pdf", "report.json", "appendix.html", "appendix.pdf", "figures"}
PANELS = {  # of the paper's Figures 11 to 14
    f"fig{n}{c}" for n, letters in (("11", "abcdef"), ("12", "ab"), ("13", "ab"), ("14", "abcdef")) for c in letters
}
OPTIONS = ("report", "--seconds", str(SECONDS), "--appendix", "--no-pdf", "-o", "made")  # of the same on a command line
TEXT = "<script>alert(1)</script> \"q\" 's' ../../../tmp/x {{ 7*7 }} *a* **b** `c` & \x00 \u202e #panic(1)"
HOSTILE = TEXT + "A" * 10_000
FILE_NAME = "1_200_S1_Inner_F3_R1<script>alert(1)<script>\"q\"'s'..{{7*7}}.mat"


@dataclass(frozen=True)
class HostileReport:
    """A report and its files, and the functions of the package (room, qualified name) that its room called for it."""

    report: Report
    files: dict[str, Path]
    functions_called: set[tuple[str, str]]


def hostile_file(folder: Path) -> Path:
    """A recording of another rig, as its data set lays it out, under a hostile name."""
    noise = np.random.default_rng(0).normal(1.9, 0.1, 80_000)
    path = folder / FILE_NAME
    savemat(path, {"Fs": 40_000.0, "Rod_1": noise, "Rod_2": noise, "Rod_3": noise, "note": HOSTILE}, oned_as="column")
    return path


def write_hostile(evidence: Evidence, folder: Path) -> HostileReport:
    """The report of `evidence` with every text that a recording may bring replaced by a hostile one, and its files."""
    refused = OtherRecord(dataset="cwru", file=HOSTILE, state=Fault.OUTER, refused=HOSTILE, cautions=(HOSTILE,))
    gone = RegisteredRecording(
        file=HOSTILE, sha256="", size_bytes=0, mtime_ns=0, status=FileStatus.MISSING, reason=HOSTILE
    )
    changed = dataclasses.replace(
        evidence,
        rig={state: _renamed(analysis) for state, analysis in evidence.rig.items()},
        shown={
            side: {state: _renamed_record(r) for state, r in records.items()}
            for side, records in evidence.shown.items()
        },
        kurtograms=tuple(_renamed_record(record) for record in evidence.kurtograms),
        register=dataclasses.replace(evidence.register, recordings=(gone,), unreadable=HOSTILE),
        matrix=dataclasses.replace(evidence.matrix, unusable=((HOSTILE, HOSTILE),)),
        other_rigs=(*evidence.other_rigs, refused),
        datasets={**evidence.datasets, refused.dataset: dataset(refused.dataset)},
        slips=tuple(dataclasses.replace(s, record=HOSTILE) for s in evidence.slips),
    )
    calls: set[tuple[CodeType, CodeType]] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        """Note who calls what; whose code that is, is looked up afterwards: drawing makes millions of calls."""
        if event == "call" and frame.f_back is not None:
            calls.add((frame.f_back.f_code, frame.f_code))

    sys.setprofile(note)
    try:
        report = assemble(changed, command=f"srbval report -o '{TEXT}'")
        files = write_report(report, folder / "report", appendix=True)
    finally:
        sys.setprofile(None)
    # What the report itself calls, directly or through another package (templates).
    called = {_function(called) for caller, called in calls if _function(caller)[0] in ("report", "")}
    return HostileReport(report, files, {(r, f) for r, f in called if r})


def _function(code: CodeType) -> tuple[str, str]:
    """Room and qualified name of a function of the package; of another package's without a room."""
    try:
        return Path(code.co_filename).relative_to(PACKAGE).parts[0], code.co_qualname
    except ValueError:
        return "", ""


def _renamed_record(record: Record) -> Record:
    return dataclasses.replace(record, analysis=_renamed(record.analysis))


def _renamed(analysis: Analysis) -> Analysis:
    recording = dataclasses.replace(analysis.recording, name=HOSTILE, file=HOSTILE, notes=(HOSTILE,))
    return dataclasses.replace(analysis, recording=recording)
