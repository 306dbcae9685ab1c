"""Which records the report is made of."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.report.blocks import Block, Listing, Tone
from srbval.report.findings.findings import Findings
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import FETCH_COMMAND, badge_of, synthetic_states

TEXTS = Texts("records")
MOST_NAMED = 20  # files in a list; report.json has all


def records_section(findings: Findings) -> Section:
    """One row per record; a warning where the rig side is synthetic."""
    rig = findings.analyses["rig"]
    synthetic = synthetic_states(rig)
    warning = TEXTS.callout("synthetic", tone=Tone.WARNING, synthetic=synthetic, fetch_command=FETCH_COMMAND)
    return TEXTS.section(
        *((warning,) if synthetic else ()),
        TEXTS.paragraph(
            "kinds",
            runs=len(findings.runs),
            states=len(rig),
            measured=sum(a.recording.origin is Origin.MEASURED for a in rig.values()),
            synthetic=synthetic,
        ),
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
            yield Listing(items=(*shown, *more))


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    at_rig = [findings.analyses["model"][state] for state in findings.measured_states]
    paper, rig = (findings.analyses[side].values() for side in ("paper", "rig"))
    groups = {"paper's speed": paper, "at the rig's speed": at_rig, "rig side": rig}
    for group, analyses in groups.items():
        yield from (_row(group, analysis) for analysis in analyses)


def _row(group: str, analysis: Analysis) -> dict[str, Any]:
    recording, shown = analysis.recording, analysis.processed
    low, high = shown.band_hz
    tracked = ", tracked" if shown.tracking.used else ""
    return {
        "name": Path(recording.file).name if recording.file else "model run",
        "badge": badge_of(analysis),
        "group": group,
        "state": recording.state.label if recording.state else "not stated",
        "speed": analysis.speed,
        "seconds": recording.seconds,
        "band": f"{low:g} to {high:g}, {shown.band_filter.value}{tracked}",
        "lines": detected_lines(analysis),
    }


def detected_lines(analysis: Analysis) -> str:
    """The detected race and roller lines in a few words, the strongest first."""
    lines = [n for n in analysis.lines if n.detected and n.harmonic == 1 and n.name in ("BPFO", "BPFI", "2xBSF")]
    if not lines:
        return "no race or roller line"
    strongest_first = sorted(lines, key=lambda n: -(n.snr or 0))
    return "; ".join(f"{n.name} {n.found_hz:.2f} Hz ({n.deviation_pct:+.2f} %)" for n in strongest_first)
