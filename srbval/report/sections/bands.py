"""The demodulation bands: how impulsive the others are, and each side's line in the other side's band."""

from collections.abc import Iterator

from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.report.blocks import Figure, FigureGrid, Paragraph
from srbval.report.figures.kurtogram import kurtogram_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordKurtogram
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import badge_of, side_of

TEXTS = Texts("bands")
ORIGIN_NAME = {"simulated": "model", "measured": "rig", "stand-in": "stand-in"}
TOP_HZ = 10_240.0  # both sides to the rig's Nyquist frequency


def band_section(findings: Findings) -> Section:
    """Kurtograms with the bands used, records that hold two combs, and the table of crossed bands."""
    panels = [_panel(letter, shown) for letter, shown in zip("abcd", findings.kurtograms, strict=True)]
    chains = {"model_chain": findings.analyses["paper"][Fault.OUTER].processed.chain,
              "rig_chain": findings.analyses["rig"][Fault.OUTER].processed.chain}  # fmt: skip
    return TEXTS.section(
        appendix=(
            TEXTS.paragraph("intro", **chains),
            FigureGrid(figures=tuple(panels), columns=2, label="Kurtograms", caption=TEXTS.text("grid")),
            *(remark for shown in findings.kurtograms for remark in two_combs(shown)),
            TEXTS.table("crossed-bands", findings.data["crossed_bands"]),
            TEXTS.paragraph("crossed", sides=list(_crossed_sides(findings))),
        )
    )


def two_combs(shown: RecordKurtogram) -> Iterator[Paragraph]:
    """Says so where a record's most impulsive band shows its line at another frequency than the band used."""
    if shown.second_comb is not None:
        yield TEXTS.paragraph(
            "two-combs",
            state=shown.analysis.recording.state,
            line=shown.line,
            ours=_comb(shown.analysis, shown.line),
            theirs=_comb(shown.second_comb, shown.line),
        )


def _comb(analysis: Analysis, name: str) -> str:
    """The line in orders with its interval, its band, and its further harmonics that show."""
    further = [line for line in analysis.lines if line.name == name and line.harmonic > 1 and line.detected]
    return TEXTS.text(
        "comb",
        first=analysis.line(name),
        further=further,
        shaft_hz=analysis.speed.value_hz,
        band_hz=analysis.processed.band_hz,
    )


def _panel(letter: str, shown: RecordKurtogram) -> Figure:
    analysis = shown.analysis
    state = Fault(analysis.recording.state or Fault.HEALTHY)
    plot = kurtogram_panel(shown, letter=letter, title=state.label, top_hz=TOP_HZ)
    return TEXTS.figure(
        "kurtogram", plot, id=f"kurtogram-{letter}", badge=badge_of(analysis), letter=letter, side=side_of(analysis),
        state=state, band_hz=analysis.processed.band_hz, picture=shown.kurtogram,
    )  # fmt: skip


def _crossed_sides(findings: Findings) -> Iterator[tuple[str, list[str], list[str]]]:
    """Each side, the lines that the other side's band still shows, and those that it does not."""
    rows = findings.data["crossed_bands"]
    for origin in dict.fromkeys(row.origin for row in rows):
        other = [row for row in rows if row.origin == origin and not row.own]
        if other:
            found, lost = ([row.line.name for row in other if row.line.detected is shown] for shown in (True, False))
            yield ORIGIN_NAME[origin], found, lost
