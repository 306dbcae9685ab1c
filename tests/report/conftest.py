"""A whole report of short runs with the rig's records, and a small one of synthetic arrays with hostile texts."""

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.recordings import Origin
from srbval.recordings.registry import shipped_recordings
from srbval.report import blocks
from srbval.report.figures.signals import draw_acceleration, draw_spectrum
from srbval.report.figures.style import Panel
from srbval.report.findings.findings import Findings, gather
from srbval.report.findings.records import SpectrumView, fault_cursors
from srbval.report.prose import literal
from srbval.report.renderers import write_report
from srbval.report.sections.assemble import assemble
from srbval.studies.harness import pages

SECONDS = 1.0  # the least that the report accepts; the report itself runs 10 s
FILES = {"report.html", "report.pdf", "report.json", "figures"}
PANELS = {  # of the paper's Figures 11 to 14
    f"fig{n}{c}" for n, letters in (("11", "abcdef"), ("12", "ab"), ("13", "ab"), ("14", "abcdef")) for c in letters
}
OPTIONS = ("report", "--seconds", str(SECONDS), "--no-pdf", "-o", "made")  # the same report on a command line


@dataclass(frozen=True)
class Made:
    """A report's findings, its tree and its files."""

    findings: Findings
    report: blocks.Report
    files: Mapping[str, Path]

    @property
    def folder(self) -> Path:
        return self.files["json"].parent

    def text(self, kind: str) -> str:
        return self.files[kind].read_text(encoding="utf-8")

    def document(self) -> dict[str, Any]:
        """Strict JSON: neither NaN nor Infinity."""
        return dict(json.loads(self.text("json"), parse_constant=lambda name: pytest.fail(f"{name} in JSON")))


HOSTILE = '<script>alert(1)</script> "q" \'s\' #panic("x") $x$ *a* _b_ `c` @ref ../../etc \x00 漢'


@pytest.fixture(scope="session")
def with_rig(tmp_path_factory):
    """The main report with short runs and the rig's excerpts that come with srbval."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("SRBVAL_RECORDINGS", raising=False)
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        patch.setattr("srbval.recordings.registry.shipped_recordings", shipped_recordings)
        found = gather(seconds=SECONDS, pages=pages())
        report = assemble(found, command=shlex.join(["srbval", *OPTIONS]), pages=pages())
        return Made(found, report, write_report(report, tmp_path_factory.mktemp("rig") / "report"))


BAND = SimpleNamespace(band_hz=(500.0, 1500.0))


def line_of(_: str) -> SimpleNamespace:
    return SimpleNamespace(kinematic_hz=97.0)


def view(origin: str = "measured", **changes: Any) -> Any:
    """Arrays of a record of noise with a tall line at 128.1 Hz and a shaft speed of 11.833 Hz, as figures need them."""
    rng, time = np.random.default_rng(1), np.arange(12_288) / 61_440
    noise, height = rng.standard_normal(time.size), rng.random(10_000)
    height[1281] = 30.0
    given = {
        "origin": Origin(origin),
        "shaft_hz": 11.833,
        "unit": "std. dev.",
        "window_s": (3.0, 3.2),
    }
    given |= {"time_s": time + 3.0, "acceleration": noise, "envelope": np.abs(noise)}
    given |= {"frequency_hz": np.arange(10_000) * 0.1, "amplitude": height}
    given |= {"power_hz": np.arange(1, 500) * 20.0, "power_db": 10 * np.log10(rng.random(499))}
    given["analysis"] = SimpleNamespace(line=line_of, processed=BAND, bearing=load_bearing("skf-22240"))
    return SimpleNamespace(**given | changes)


def spectrum(record: Any) -> SpectrumView:
    """Envelope spectrum up to 600 Hz with the harmonics of BPFI, over half of it as a healthy bearing's."""
    healthy = SimpleNamespace(frequency_hz=record.frequency_hz, amplitude=record.amplitude / 2)
    cursors = fault_cursors(record, SimpleNamespace(name="BPFI", kinematic_hz=128.04), 600.0, 2)
    return SpectrumView(record=record, healthy=healthy, cursors=cursors, peaks=((128.1, 30.0),), end_hz=600.0)


@pytest.fixture(scope="session")
def report():
    """A small report with blocks of every kind; its table has intervals, a missing value and a hostile one."""
    stand_in = blocks.Figure(
        id="fig11b",
        label="Figure 11b",
        caption="Acceleration.",
        alt="Noise without bursts, 195 ms long",
        draw=Panel(draw_acceleration, view("stand-in"), limit=4.0, letter="b", title="healthy"),
        badge="stand-in",
    )
    simulated = blocks.Figure(
        id="fig12a",
        label="Figure 12a",
        caption="Envelope spectrum.",
        alt="Six lines at BPFO's harmonics",
        draw=Panel(draw_spectrum, spectrum(view("simulated")), top=33.6),
        wide=False,
    )
    columns = {
        "defect": blocks.TableColumn("Defect"),
        "kinematic": blocks.TableColumn("Kinematic", "Hz", ".2f"),
        "model": blocks.TableColumn("Model", "Hz", ".3f"),
        "deviation": blocks.TableColumn("Deviation", "%", "+.2f"),
        "verdict": blocks.TableColumn("Verdict"),
    }
    rows = (
        ("outer", 96.79, 96.998, 0.2149, "within", "good", 0.004, "simulated", "cage 96.997"),
        ("inner", 128.04, float("nan"), -0.164, "outside", "bad"),
        (HOSTILE, None, 1.0, 0.0, "A" * 10_000),
    )
    keys = (*columns, "verdict_tone", "model_ci95", "model_badge", "model_note")
    table = blocks.ReportTable(
        id="table6",
        label="Table 6",
        caption="Fault frequencies.",
        columns=columns,
        rows=tuple(dict(zip(keys, row, strict=False)) for row in rows),
        notes=("Deviation from **kinematics**.",),
    )
    texts = (
        blocks.Paragraph("Text with **weight** and `code`."),
        blocks.Paragraph(literal(HOSTILE)),
        blocks.Paragraph("A" * 10_000),
        blocks.Listing(("first", "second")),
        blocks.Callout(blocks.Tone.WARNING, "A stand-in.", title="Mind:"),
        blocks.Command("srbval report -o out"),
    )
    grid = blocks.FigureGrid(figures=(stand_in,), columns=2, caption="One panel.")
    return blocks.Report(
        title="Model against rig",
        subtitle="A test",
        verdict=blocks.VerdictBox(
            tone=blocks.Tone.GOOD,
            headline="Within **0.25 %**.",
            points=("One.", "Two."),
            figure=replace(simulated, id="answer"),
        ),
        sections=(
            blocks.Section(id="text", title="Text " + HOSTILE, blocks=texts),
            blocks.Section(id="numbers", title="Numbers", blocks=(table,)),
            blocks.Section(id="pictures", title="Pictures", blocks=(grid, simulated)),
        ),
        data={"table6": [{"defect": "outer", "model_hz": np.float64(96.998), "rig_hz": float("nan")}]},
    )
