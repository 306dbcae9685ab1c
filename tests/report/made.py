"""A whole report of short runs, and the names of its files."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import Report
from srbval.report.findings.findings import Findings

SECONDS = 1.2  # enough to read the lines; the report itself runs 10 s
FILES = {"report.html", "report.pdf", "report.json", "figures"}
PANELS = {  # of the paper's Figures 11 to 14
    f"fig{n}{c}" for n, letters in (("11", "abcdef"), ("12", "ab"), ("13", "ab"), ("14", "abcdef")) for c in letters
}
OPTIONS = ("report", "--seconds", str(SECONDS), "--no-pdf", "-o", "made")  # the same report on a command line


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
        """Strict JSON: neither NaN nor Infinity."""
        return dict(json.loads(self.text("json"), parse_constant=lambda name: pytest.fail(f"{name} in JSON")))
