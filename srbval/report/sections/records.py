"""Which records the report is made of, and in which bands they are read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.report.blocks import Block, Figure, Listing, Section, Tone
from srbval.report.figures.images import kurtogram_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordKurtogram
from srbval.report.section_texts import Texts, badge_of, side_of

TEXTS, BANDS = Texts("records"), Texts("bands")
MOST_NAMED = 20  # files in a list; report.json has all
NAMED_LINES = ("BPFO", "BPFI", "2xBSF")  # of races and rollers
TOP_HZ = 10_240.0  # of kurtograms: both sides to the rig's Nyquist frequency


def records_section(findings: Findings) -> Section:
    """One row per record."""
    return TEXTS.section(
        TEXTS.paragraph("kinds", runs=len(findings.runs)),
        *_problems(findings),
        TEXTS.table("records", _rows(findings)),
        appendix=(TEXTS.paragraph("chain"), TEXTS.table("lines-found", _rows(findings))),
    )


def _problems(findings: Findings) -> Iterator[Block]:
    """What of the registered data is not used, and what is used with a caution; nothing where all is well."""
    if findings.data["register_unreadable"]:
        yield TEXTS.callout("unreadable", tone=Tone.WARNING, why=findings.data["register_unreadable"])
    for name, rows in (("not-used", findings.data["recordings_not_used"]), ("cautions", findings.data["cautions"])):
        if rows:
            yield TEXTS.callout(name, tone=Tone.WARNING, count=len(rows), files=len({row["file"] for row in rows}))
            shown = (TEXTS.text(f"{name}-row", row=row) for row in rows[:MOST_NAMED])
            more = (TEXTS.text("more", more=len(rows) - MOST_NAMED),) if len(rows) > MOST_NAMED else ()
            yield Listing((*shown, *more))


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    groups = {"paper's speed": "paper", "at the rig's speed": "model", "rig side": "rig"}
    for group, analysis in ((name, one) for name, side in groups.items() for one in findings.analyses[side].values()):
        recording, shown = analysis.recording, analysis.processed
        low, high = shown.band_hz
        lines = [line for line in analysis.lines if line.detected and line.harmonic == 1 and line.name in NAMED_LINES]
        yield {
            "name": Path(recording.file).name if recording.file else "model run",
            "badge": badge_of(analysis),
            "group": group,
            "state": recording.state.label if recording.state else "not stated",
            "speed": analysis.speed,
            "seconds": recording.seconds,
            "band": f"{low:g} to {high:g}, {shown.band_filter.value}{', tracked' if shown.tracking.used else ''}",
            "lines": "; ".join(
                f"{line.name} {line.found_hz:.2f} Hz ({line.deviation_pct:+.2f} %)"
                for line in sorted(lines, key=lambda line: -(line.snr or 0))
            )
            or "no race or roller line",
        }


def band_section(findings: Findings) -> Section:
    """Kurtograms with the bands used."""
    panels = [_kurtogram(letter, shown) for letter, shown in zip("abcd", findings.kurtograms, strict=True)]
    chains = {"model_chain": findings.analyses["paper"][Fault.OUTER].processed.chain,
              "rig_chain": findings.analyses["rig"][Fault.OUTER].processed.chain}  # fmt: skip
    return BANDS.section(appendix=(BANDS.paragraph("intro", **chains), BANDS.grid("grid", panels, "Kurtograms")))


def _kurtogram(letter: str, shown: RecordKurtogram) -> Figure:
    analysis = shown.analysis
    state = Fault(analysis.recording.state or Fault.HEALTHY)
    plot = kurtogram_panel(shown, letter=letter, title=state.label, top_hz=TOP_HZ)
    return BANDS.figure(
        "kurtogram", plot, id=f"kurtogram-{letter}", badge=badge_of(analysis), letter=letter, side=side_of(analysis),
        state=state, band_hz=analysis.processed.band_hz, picture=shown.kurtogram,
    )  # fmt: skip
