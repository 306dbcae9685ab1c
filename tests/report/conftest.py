"""A small report of synthetic arrays that holds one of every kind of block."""

from __future__ import annotations

import shlex
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from srbval.recordings.registry.register import shipped_recordings
from srbval.report import (
    Badge,
    Callout,
    Cell,
    Column,
    Command,
    Figure,
    FigureGrid,
    KeyValues,
    Listing,
    Paragraph,
    Report,
    Section,
    Table,
    Tone,
    VerdictBox,
    literal,
)
from srbval.report.figures.acceleration import acceleration_panel
from srbval.report.figures.spectrum import envelope_spectrum_panel, fault_cursors
from srbval.report.reports import MadeReport, make_report

from .whole import OPTIONS, SECONDS, HostileReport, hostile_file, write_hostile

HOSTILE = '<script>alert(1)</script> "q" \'s\' #panic("x") $x$ *a* _b_ `c` @ref ../../etc \x00 漢'


@pytest.fixture(scope="session")
def alone(tmp_path_factory: pytest.TempPathFactory) -> tuple[MadeReport, Path]:
    """A report with no recording of the rig, but one of another rig under a hostile name."""
    folder = tmp_path_factory.mktemp("alone")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SRBVAL_RECORDINGS", str(hostile_file(tmp_path_factory.mktemp("other")).parent))
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        return make_report(folder / "report", seconds=SECONDS, appendix=True), folder / "report"


@pytest.fixture(scope="session")
def with_rig(tmp_path_factory: pytest.TempPathFactory) -> tuple[MadeReport, Path]:
    """The report that everybody gets first, but for its short runs: with the rig's excerpts that come with srbval."""
    folder = tmp_path_factory.mktemp("rig")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("SRBVAL_RECORDINGS", raising=False)
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        patch.setattr("srbval.recordings.registry.lookup.shipped_recordings", shipped_recordings)
        made = make_report(folder / "report", seconds=SECONDS, appendix=True, command=shlex.join(["srbval", *OPTIONS]))
        return made, folder / "report"


@pytest.fixture(scope="session")
def hostile_report(alone: tuple[MadeReport, Path], tmp_path_factory: pytest.TempPathFactory) -> HostileReport:
    """A whole report in which every text that a recording may bring is hostile, and its files."""
    return write_hostile(alone[0].evidence, tmp_path_factory.mktemp("hostile"))


@pytest.fixture(scope="session")
def hostile(hostile_report: HostileReport) -> dict[str, Path]:
    """The files of that report."""
    return hostile_report.files


@pytest.fixture(scope="session")
def panels() -> tuple[Figure, ...]:
    """A simulated and a stand-in panel."""
    rng = np.random.default_rng(7)
    time = np.arange(4000) / 20_480
    acceleration = partial(
        acceleration_panel, time_s=time, acceleration=rng.standard_normal(4000), envelope=np.ones(4000),
        origin="stand-in", letter="b", title="healthy", window_s=(0.0, float(time[-1])), y_limits=(-4.0, 4.0),
    )  # fmt: skip
    stand_in = Figure(
        id="fig11b", label="Figure 11b", caption="Acceleration.", alt="Noise without bursts, 195 ms long",
        draw=acceleration, synthetic=True,
    )  # fmt: skip
    frequency = np.arange(1, 6000) * 0.1
    spectrum = partial(
        envelope_spectrum_panel, frequency_hz=frequency, amplitude=rng.random(5999), shaft_hz=11.83,
        origin="simulated", cursors=fault_cursors("BPFO", 96.79, f_max_hz=600), peaks=(),
        healthy=(frequency, np.zeros(5999)), f_max_hz=600.0, y_limits=(0.0, 1.12),
    )  # fmt: skip
    model = Figure(
        id="fig12a", label="Figure 12a", caption="Envelope spectrum.", alt="Six lines at BPFO's harmonics",
        draw=spectrum, wide=False,
    )  # fmt: skip
    return stand_in, model


@pytest.fixture(scope="session")
def table() -> Table:
    """A table with intervals, badges, tones, notes, a missing and a hostile value."""
    return Table(
        id="table6",
        label="Table 6",
        caption="Fault frequencies.",
        columns=(
            Column(title="Defect"),
            Column(title="Kinematic", unit="Hz", format=".2f"),
            Column(title="Model", unit="Hz", format=".3f"),
            Column(title="Deviation", unit="%", format="+.2f"),
            Column(title="Verdict"),
        ),
        rows=(
            (
                "outer",
                96.79,
                Cell(value=96.998, ci95=0.004, badge=Badge.SIMULATED, note="cage 96.997"),
                0.2149,
                Cell(value="within", tone=Tone.GOOD),
            ),
            ("inner", 128.04, float("nan"), -0.164, Cell(value="outside", tone=Tone.BAD)),
            (HOSTILE, None, 1.0, 0.0, "A" * 10_000),
        ),
        notes=("Deviation from **kinematics**.",),
    )


@pytest.fixture(scope="session")
def report(panels: tuple[Figure, ...], table: Table) -> Report:
    """The whole."""
    blocks = (
        Paragraph("Text with **weight** and `code`."),
        Paragraph(literal(HOSTILE)),
        Paragraph("A" * 10_000),
        Listing(("first", "second"), numbered=True),
        Callout(Tone.WARNING, "A stand-in.", title="Mind:"),
        Command("srbval report -o out"),
        KeyValues({"seed": 1, "note": HOSTILE, "nothing": None}),
    )
    return Report(
        title="Model against rig",
        subtitle="A test",
        generated_utc=datetime(2025, 1, 2, 3, 4, 5, tzinfo=UTC),
        verdict=VerdictBox(tone=Tone.GOOD, headline="Within **0.25 %**.", points=("One.", "Two.")),
        sections=(
            Section(id="text", title="Text " + HOSTILE, blocks=blocks),
            Section(id="numbers", title="Numbers", blocks=(table,)),
            Section(
                id="pictures",
                title="Pictures",
                blocks=(FigureGrid(figures=panels[:1], columns=2, caption="One panel."), panels[1]),
            ),
        ),
        data={"table6": [{"defect": "outer", "model_hz": np.float64(96.998), "rig_hz": float("nan")}]},
    )
